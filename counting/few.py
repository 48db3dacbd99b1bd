import sys; sys.path.insert(0,'/work/wt/me/counting')
from b import *
print(umbra.__file__)
for name in sys.argv[1].split(','):
    scene,samples,caster,tree,patches=load(name)
    binner=EdgeBinner(caster,2560_000_000)
    def mute(p, few):
        f=p.frame.copy(); m=np.isinf(p.graze)!=few; g=p.graze.copy()
        f[m,8:11]=(0,0,-1e9); g[m]=1e-3
        return p._replace(frame=f, graze=g)
    for c in sys.argv[2].split(','):
        suns=CASES[c]
        if c=='sky': suns=np.ascontiguousarray(suns[::9])
        w=weights(len(suns)); r={}
        for few in (True,False):
            cs=[PatchCounter(mute(p,few),binner,tree) for p in patches]
            ts=[]
            for _ in range(4):
                t=time.process_time()
                for k in cs: k.add_weights(suns,w,np.zeros((1,k.size),np.int32))
                ts.append(time.process_time()-t)
            r[few]=min(ts)*1e3
        print(f'{name} {c} {len(suns)}: few {r[True]:.0f} others {r[False]:.0f} ms',flush=True)

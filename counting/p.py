import sys; sys.path.insert(0,'/work/wt/me/counting')
from b import *
import prof.patch_count as pc
L={0:'setup',1:'ask',2:'covered?',3:'find_rims',4:'add_rims',5:'settle',6:'graze rays',7:'few rays',20:'n facing',21:'n lit ask',22:'n covered',25:'n settled',26:'n graze',27:'n few',28:'no rims',29:'rims',30:'asked',40:'rows',41:'vectors',42:'met',43:'stamped'}
for name in sys.argv[1].split(','):
    scene,samples,caster,tree,patches=load(name)
    binner=EdgeBinner(caster,256_000_000)
    for c in sys.argv[2].split(','):
        suns=CASES[c]
        if c=='sky': suns=np.ascontiguousarray(suns[::5])
        w=weights(len(suns))
        for _ in range(2):
            pc.PROF.clear()
            for p in patches:
                k=pc.PatchCounter(p,binner,tree); s=np.zeros((1,k.size),np.int32); k.add_weights(suns,w,s)
        a=sum(pc.PROF)
        print(name,c,len(suns),'| '.join(f'{v} {a[k]/2.596e6:.0f} ms' if k<10 else f'{v} {a[k]}' for k,v in L.items()),flush=True)

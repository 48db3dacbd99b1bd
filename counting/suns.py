import sys; sys.path.insert(0,'/work/wt/me/counting')
from b import *
import umbra.cpu.patch_count as pc
print(umbra.__file__)
for name in sys.argv[1].split(','):
    scene,samples,caster,tree,patches=load(name); binner=EdgeBinner(caster,256_000_000)
    s0=CASES['sky']
    z=s0[:,2]; ring=(np.arcsin(z)/np.radians(9)).astype(int); az=np.arctan2(s0[:,1],s0[:,0]); az=np.where(ring%2,az,-az)
    snake=np.ascontiguousarray(s0[np.lexsort((az,ring))])
    for order,suns in (('golden',s0),('snake',snake)):
        w=np.ones((577,1),np.int32)
        for n in (64,32,16,577):
            pc._SUNS=n
            t=time.process_time(); r=count(patches,binner,tree,suns,w); t=time.process_time()-t
            print(name,order,n,f'{t*1e3:.0f}',hashlib.sha1(r.tobytes()).hexdigest()[:12],flush=True)

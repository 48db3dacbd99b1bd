import sys; sys.path.insert(0,'/work/wt/me/counting')
from b import *
for name in ['delft','vienna','zurich']:
    scene,samples,caster,tree,patches=load(name)
    n=np.concatenate([np.diff(p.first) for p in patches]); inf=np.concatenate([np.isinf(p.graze) for p in patches])
    thick=np.concatenate([p.tau>1e-6 for p in patches])
    print(name,'ray patches',inf.sum(),'samples',n[inf].sum(),'marks',sum(len(p.marks) for p in patches),'cuts',sum(len(p.cuts) for p in patches),'thick',thick.sum())
    for a,b in [(1,1),(2,4),(5,8),(9,16),(17,32),(33,64),(65,256),(257,1<<30)]:
        m=(n>=a)&(n<=b); print('  ',a,b,'patches',m.sum(),'samples',n[m].sum(), 'rays', (m&inf).sum())

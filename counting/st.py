import sys; sys.path.insert(0,'/work/wt/me/counting')
from b import *
import umbra.cpu.patch_count as pc
for name in ['delft']:
    scene,samples,caster,tree,patches=load(name); binner=EdgeBinner(caster,2560_000_000)
    for c in ['day','low']:
        suns=CASES[c]; w=weights(len(suns)); pc.STACKS.clear()
        for p in patches:
            k=PatchCounter(p,binner,tree); k.add_weights(suns,w,np.zeros((1,k.size),np.int32))
        print(c,'packets rays hinted nodes leaves alldark beside',sum(pc.STACKS)[1000:1007])

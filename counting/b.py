import sys, time, hashlib, pickle, os
import numpy as np
import umbra
from umbra.cpu.patch_bins import EdgeBinner
from umbra.cpu.patch_count import PatchCounter
from umbra.cpu.patches import make_patches
from umbra.rays.face_tree import make_face_tree
from umbra.receivers.samples import sample_surfaces
from umbra.volume.adjacency import make_caster
from umbra_benchmarks.walls import make_low_suns, _cut, _make
from umbra_benchmarks.scenes import make_suns, make_town
D='/work/shared/data/'
FILES=dict(delft='delft.city.json',vienna='vienna_lod2.city.jsonl',zurich='zurich_lod2.city.json',block='urban_block.obj')
def sky(n=577):
    # golden spiral over hemisphere
    k=np.arange(n)+.5; z=k/n; a=k*np.pi*(3-5**.5)
    r=np.sqrt(1-z*z); return np.stack([r*np.cos(a),r*np.sin(a),z],1)
def load(name, spacing=.5):
    scene=_make(make_town(8333,2500.0,2)) if name=='city' else umbra.read(D+FILES[name])
    samples=sample_surfaces(scene, spacing)
    soup=scene.triangles()
    caster=make_caster(soup.vertices, soup.faces, scene.groups()[soup.part])
    tree=make_face_tree(caster, float(np.abs(scene.origin).max()))
    pieces=[samples.piece(p) for p in _cut(len(samples.points))]
    patches=[make_patches(p, tree) for p in pieces]
    return scene,samples,caster,tree,patches
def weights(n): 
    rng=np.random.default_rng(1); return rng.integers(1,1<<20,(n,1)).astype(np.int32)
def count(patches,binner,tree,suns,w):
    binner.forget()
    out=[]
    for p in patches:
        c=PatchCounter(p,binner,tree); s=np.zeros((w.shape[1],c.size),np.int32)
        c.add_weights(suns,w,s); out.append(s)
    return np.concatenate(out,1)
CASES=dict(day=make_suns(),low=make_low_suns(),sky=sky())
if __name__=='__main__':
    names=sys.argv[1].split(','); cases=sys.argv[2].split(','); rep=int(sys.argv[3])
    for name in names:
        scene,samples,caster,tree,patches=load(name)
        print(name,len(samples.points),'samples',[len(p.size) for p in patches],'patches',len(caster.faces),'faces',flush=True)
        binner=EdgeBinner(caster,256_000_000)
        for c in cases:
            suns=CASES[c]; w=weights(len(suns)); ts=[];tb=[]
            for _ in range(rep):
                t=time.process_time(); r=count(patches,binner,tree,suns,w); ts.append(time.process_time()-t)
                binner.forget(); t=time.process_time()
                for k in range(0,len(suns),64): binner.bin(np.ascontiguousarray(suns[k:k+64]))
                tb.append(time.process_time()-t)
            print(f'{name} {c}: {min(ts)*1e3:.0f} ms all, bin {min(tb)*1e3:.0f}  {hashlib.sha1(r.tobytes()).hexdigest()[:12]}',flush=True)

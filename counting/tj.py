import sys; sys.path.insert(0,'/work/wt/me/counting')
from b import *
import umbra
for name in sys.argv[1].split(','):
    scene=umbra.read(D+FILES[name]); soup=scene.triangles()
    caster=make_caster(soup.vertices, soup.faces, scene.groups()[soup.part])
    b=EdgeBinner(caster,0); ends=b.edges.ends
    print(name,'faces',len(caster.faces),'closed comps',caster.is_closed.sum(),'of',len(caster.is_closed),'unique edges',len(ends))
    for c in ('day','low'):
        suns=CASES[c]
        e,ch,first=b._find(suns)
        bins=b._bin(suns)
        print(c,'silhouette edges per sun',np.diff(first).mean(),'abs change hist',np.bincount(np.abs(ch))[:6]/len(suns),'entries per sun',len(bins.entries)/len(suns),'table MB',bins.bytes/1e6/len(suns))
        # vertical edges share
        x=ends[e]; hor=np.hypot(x[:,0]-x[:,3],x[:,1]-x[:,4]); L=np.linalg.norm(x[:,:3]-x[:,3:],axis=1)
        print('  vertical',(hor<1e-9).mean(),'horizontal',(np.abs(x[:,2]-x[:,5])<1e-9).mean(),'median len',np.median(L),'mean',L.mean())
        # group vertical by xy, overlap cancel
        s=0
        q=slice(first[len(suns)//2],first[len(suns)//2+1]); xe=ends[e[q]]; cc=ch[q].astype(int)
        v=np.hypot(xe[:,0]-xe[:,3],xe[:,1]-xe[:,4])<1e-9; xv=xe[v]; cv=cc[v]
        key=np.round(xv[:,:2],6); _,g=np.unique(key,axis=0,return_inverse=True); g=g.ravel()
        n0=len(xv); n1=0
        for k in range(g.max()+1):
            m=g==k; zs=np.unique(np.round(np.r_[xv[m,2],xv[m,5]],6)); lev=np.zeros(len(zs)+1)
            up=np.where(xv[m,5]>xv[m,2],cv[m],-cv[m]); lo=np.minimum(xv[m,2],xv[m,5]); hi=np.maximum(xv[m,2],xv[m,5])
            for a,bb,u in zip(lo,hi,up):
                i,j=np.searchsorted(zs,[a-1e-7,bb-1e-7]); lev[i]+=u; lev[j]-=u
            r=np.cumsum(lev)[:-1]; n1+=(np.diff(np.r_[0,r,0])!=0).sum()-1 if (r!=0).any() else 0
        print('  one sun: vertical silhouettes',n0,'after merging by collinear',n1,'of',len(xe))

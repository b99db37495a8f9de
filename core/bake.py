"""The bake from start to end; read this as the table of contents."""

from __future__ import annotations

import time
from contextlib import contextmanager
from collections.abc import Iterator

import numpy as np

from .direct.illumination import DirectLight
from .direct.lamps import Panel, place
from .gather import Points, gather_direct, gather_indirect, shadow_boundary
from .hemisphere import Hemispheres
from .parallel import Workers
from .patches import Patches, make_patches, unit_space
from .progress import Progress
from .receivers import Receivers, make_receivers
from .reconstruction import Fit, Samples
from .result import BakedObject, BakeResult, Report
from .sampling import stream
from .scene import Float64, Scene
from .settings import Settings
from .transport import Transport, make_transport
from .visibility import Visibility

PASSES=4; RAYS=32; PATCHES=8192; TRAYS=128; SHADOW=4; EXTRA=12
ALPHAS=(1e-4,1e-2,0.1,0.5)

def bake(scene, settings, progress=None):
    progress = progress or Progress()
    T={}
    t=time.perf_counter()
    def tick(n):
        nonlocal t
        T[n]=T.get(n,0)+time.perf_counter()-t; t=time.perf_counter()
    with Workers(settings.threads, progress) as workers:
        space=unit_space(scene)
        rec=make_receivers(scene,space,tessellate=settings.tessellate,size=settings.size,triangles=settings.triangles)
        tick('cells')
        patches=make_patches(scene,space,PATCHES)
        tick('patches')
        vis=Visibility(patches.corners)
        lights=[place(l,space) for l in scene.lamps]
        for tri in np.flatnonzero(patches.emission[patches.patch].max(1)>0):
            pass
        em=np.array([s.emission for s in scene.surfaces])
        for o in scene.objects:
            for k in np.flatnonzero(em[o.surface].max(1)>0):
                lights.append(Panel(o.name,space.normalise(o.vertices[o.triangles[k]]),em[o.surface[k]],True))
        dl=DirectLight(lights,vis,settings.seed)
        tick('embree')
        halves=[make_transport(patches,vis,dl,np.zeros(3),workers,rays=TRAYS,shadow_rays=SHADOW,tolerance=1e-4,seed=settings.seed,purpose=p) for p in ('A','B')]
        tick('transport')
        hemi=Hemispheres(patches,vis,RAYS,stream(settings.seed,'gather patterns'))
        tables=[h.by_code(h.reflected) for h in halves]
        n=len(rec.cells)
        shift=stream(settings.seed,'cells').random((n,2))
        ind=[Samples(n,3) for _ in halves]; dire=[Samples(n,3) for _ in halves]
        sig=[]; rays=0; every=np.arange(n); invalid=np.zeros(n,bool)
        for k in range(PASSES):
            pts=Points(rec.cells,every,k,shift)
            e,var,enc=gather_indirect(pts,hemi,tables[k%2],settings.seed,k,workers)
            tick('gather')
            d,s,r=gather_direct(pts,dl,SHADOW,settings.seed,k,workers)
            tick('direct')
            rays+=r+n*RAYS
            valid=~(enc&(e.max(1)<=0)&(d.max(1)<=0))
            invalid|=~valid
            ind[k%2].add(slice(None),pts.barycentric,e,var,valid)
            dire[k%2].add(slice(None),pts.barycentric,d,np.zeros_like(d),valid)
            sig.append(s)
            tick('accumulate')
        cv=rec.corner_vertex[rec.cells.element]
        edge=shadow_boundary(cv,rec.vertices,sig)&~invalid
        chosen=np.flatnonzero(edge)
        for k in range(PASSES,PASSES+EXTRA):
            pts=Points(rec.cells,chosen,k,shift)
            d,s,r=gather_direct(pts,dl,SHADOW,settings.seed,k,workers); rays+=r
            dire[k%2].add(chosen,pts.barycentric,d,np.zeros_like(d),np.ones(len(chosen),bool))
        tick('boundary')
        fits={}
        for name,sm in (('indirect',ind),('direct',dire)):
            tot=sm[0]+sm[1]
            fit=Fit(rec,tot)
            tick('fit setup')
            sys=[fit.system(x) for x in sm]
            best=None
            for a in ALPHAS:
                xs=[fit.solve(y,a) for y in sys]
                w=rec.cells.area
                score=sum((w[:,None]*sm[1-i].squared_residual(fit.at_corners(xs[i]))).sum() for i in (0,1))
                print(name,a,score/w.sum()/2, (( (xs[0]-xs[1])/2)**2).mean())
                if best is None or score<best[0]: best=(score,a,xs)
            x=fit.fill(np.maximum(fit.solve(fit.system(tot),best[1]),0))
            fits[name]=x
            tick('fit '+name)
        print({k:round(v,2) for k,v in T.items()}, 'total',sum(T.values()),'cells',n,'patches',len(patches),'tri',len(patches.corners),'rays M',rays/1e6, 'boundary',len(chosen),'invalid',invalid.sum(),'measured',(~fit.measured).sum())
        alb=np.array([s.albedo for s in scene.surfaces])[rec.element_surface]
        E=(fits['direct']+fits['indirect'])[rec.corner_vertex]
        L=em[rec.element_surface][:,None]+alb[:,None]*E/np.pi
        objs=[]
        for i,o in enumerate(rec.objects):
            m=rec.meshes[i]; sl=slice(rec.first[i],rec.first[i+1])
            objs.append(BakedObject(o.name,m.vertices,m.triangles,m.parent,m.barycentric,{'combined':L[sl].astype('f4')}))
        global DEBUG; DEBUG=(rec,fits,fit)
        return BakeResult(tuple(objs),Report())

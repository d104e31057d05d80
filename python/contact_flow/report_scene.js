// SPDX-License-Identifier: BSD-3-Clause
// What moves: bodies, camera, buttons and captions. Drawn by three.js (report_three.js), without it or without WebGL by report_flat.js.
function rounded(kind,size){   // {v: vertices, f: faces} in the frame of the shape, about its z
 const v=[],f=[],N=14;
 if(kind==="box"){const [x,y,z]=size.map(s=>s/2);for(let k=0;k<8;k++)v.push([k&1?x:-x,k&2?y:-y,k&4?z:-z]);
  return {v,f:[[0,2,3,1],[4,5,7,6],[0,1,5,4],[2,6,7,3],[0,4,6,2],[1,3,7,5]]}}
 if(kind==="cylinder"){const [r,l]=size,top=[],foot=[];
  for(let k=0;k<N;k++){const a=2*Math.PI*k/N;v.push([r*Math.cos(a),r*Math.sin(a),-l/2],[r*Math.cos(a),r*Math.sin(a),l/2]);
   const n=(k+1)%N;f.push([2*k,2*n,2*n+1,2*k+1]);foot.unshift(2*k);top.push(2*k+1)}
  f.push(top,foot);return {v,f}}
 const M=8,[r]=size;
 for(let i=0;i<=M;i++)for(let k=0;k<N;k++){const b=Math.PI*i/M,a=2*Math.PI*k/N;v.push([r*Math.sin(b)*Math.cos(a),r*Math.sin(b)*Math.sin(a),-r*Math.cos(b)])}
 for(let i=0;i<M;i++)for(let k=0;k<N;k++){const n=(k+1)%N;f.push([i*N+k,i*N+n,(i+1)*N+n,(i+1)*N+k])}
 return {v,f}}
const turned=(m,p)=>[m[0]*p[0]+m[1]*p[1]+m[2]*p[2],m[3]*p[0]+m[4]*p[1]+m[5]*p[2],m[6]*p[0]+m[7]*p[1]+m[8]*p[2]];
const matrix=([w,x,y,z])=>[1-2*(y*y+z*z),2*(x*y-w*z),2*(x*z+w*y),2*(x*y+w*z),1-2*(x*x+z*z),2*(y*z-w*x),2*(x*z-w*y),2*(y*z+w*x),1-2*(x*x+y*y)];
function kinkiest(directions){   // the direction whose two slopes differ most, else the largest
 const of=e=>["up","down"].map(s=>e[s].value),size=v=>v?Math.max(...v.map(Math.abs)):0;
 let best=0,most=-1;directions.forEach((e,k)=>{const [u,d]=of(e),m=u&&d?Math.max(...u.map((v,i)=>Math.abs(v+d[i]))):0,s=(m>1e-9?1e3*m:0)+1e-3*Math.max(size(u),size(d));if(s>most+1e-12){most=s;best=k}});return best}
const GHOSTS=[["up","#d95f02","+"],["down","#1f77b4","−"]];
// The camera of S: right, up and towards who looks, unit vectors.
function axes(S){const ca=Math.cos(S.az),sa=Math.sin(S.az),ce=Math.cos(S.el),se=Math.sin(S.el);return [[-sa,ca,0],[-se*ca,-se*sa,ce],[ce*ca,ce*sa,se]]}
function figure(){const R=D.figure;if(!R.t){$("figure").remove();return}
 const canvas=$("robot"),flat=R.plane.length===2,points=[];let drag=null,playing=null;
 R.poses.forEach(f=>f.forEach(p=>points.push(p)));R.contacts.forEach(f=>f.forEach(p=>{if(p[0]!==null)points.push(p)}));
 const bodies=R.shapes.map(s=>{const b=s.mesh||rounded(s.kind,s.size);return {link:s.link,shape:s,colour:s.colour,two:!!s.mesh,f:b.f,v:b.v.map(p=>{const q=turned(s.turn,p);return [q[0]+s.at[0],q[1]+s.at[1],q[2]+s.at[2]]})}});
 bodies.forEach(b=>{const p=R.poses[0][b.link],m=matrix(p.slice(3,7));b.v.forEach(v=>points.push(turned(m,v).map((x,k)=>x+p[k])))});   // where it begins, as a whole
 const lo=[0,1,2].map(i=>points.reduce((m,p)=>Math.min(m,p[i]),Infinity)),hi=[0,1,2].map(i=>points.reduce((m,p)=>Math.max(m,p[i]),-Infinity));
 const mid=lo.map((v,i)=>(v+hi[i])/2),span=Math.max(...hi.map((v,i)=>v-lo[i]),.05);canvas.dataset.span=span;
 let most=1e-12;for(const f of R.contacts)for(const p of f)if(p[3]!==null)most=Math.max(most,Math.hypot(p[3],p[4],p[5]));
 const H=380,az=flat?-Math.PI/2:-1.1,el=R.plane==="xy"?Math.PI/2:flat?0:.25;
 const S={figure:R,bodies,span,most,az,el,zoom:1,at:mid.slice(),ghost:null,scale0:.8*H/span};   // at: what the camera looks at
 // The force of a contact as an arrow [from, to], null where it is open or has none.
 S.arrow=(p,holds)=>{const f=[p[3],p[4],p[5]];return holds&&Math.hypot(...f)>1e-9*most?[p.slice(0,3),p.slice(0,3).map((x,j)=>x+f[j]*.35*span/most)]:null};
 const ghost=make("select",undefined,$("ghosts"));[{name:"none"}].concat(R.ghosts).forEach((g,k)=>{const o=make("option",k?"± "+g.name:"no ghosts",ghost);o.value=k});
 if(R.ghosts.length){const name=D.derivative.directions[kinkiest(D.derivative.directions)].name;ghost.value=1+Math.max(0,R.ghosts.findIndex(g=>g.name===name))}else $("ghosts").hidden=true;
 ghost.addEventListener("change",()=>all());
 const speed=make("select",undefined,$("speed"));[1,.5,.2,.1,.02].forEach(s=>{const o=make("option",s+"×",speed);o.value=s});
 if(R.missing.length)$("missing").textContent=R.missing.join("; ");
 // Orbit: drag turns, with shift or another button moves; the wheel zooms; a double click is the first view again.
 canvas.addEventListener("mousedown",e=>{drag=[e.offsetX,e.offsetY,e.shiftKey||e.button>0];if(e.button>0)e.preventDefault()});window.addEventListener("mouseup",()=>{drag=null});
 canvas.addEventListener("contextmenu",e=>e.preventDefault());
 canvas.addEventListener("mousemove",e=>{if(!drag)return;const dx=e.offsetX-drag[0],dy=e.offsetY-drag[1],s=S.scale0*S.zoom,[right,up]=axes(S);
  if(drag[2])S.at=S.at.map((x,k)=>x+(-dx*right[k]+dy*up[k])/s);else{S.az+=dx*.01;S.el=Math.max(-1.5708,Math.min(1.5708,S.el+dy*.01))}
  drag=[e.offsetX,e.offsetY,drag[2]];all()});
 canvas.addEventListener("wheel",e=>{e.preventDefault();S.zoom=Math.max(.2,Math.min(30,S.zoom*Math.exp(-e.deltaY*.001)));all()},{passive:false});
 canvas.addEventListener("dblclick",()=>{S.az=az;S.el=el;S.zoom=1;S.at=mid.slice();all()});
 const stop=()=>{playing=null;$("play").textContent="play"};
 const step=now=>{if(!playing)return;const t=playing.t+(now-playing.now)/1000*Number(speed.value);if(t>=view.to){stop();setCursor(view.to);return}setCursor(t);requestAnimationFrame(step)};
 $("play").addEventListener("click",()=>{if(playing)return stop();const t=view.cursor===null||view.cursor>=view.to||view.cursor<view.from?view.from:view.cursor;playing={now:performance.now(),t};$("play").textContent="stop";requestAnimationFrame(step)});
 let paint=null;
 const choose=(painter,by)=>{paint=painter;canvas.dataset.painter=by;$("painter").textContent=by==="three.js"?"Drawn by three.js.":"Drawn without WebGL"+(D.three.missing?": "+D.three.missing:"")+"."};
 const plainly=()=>{choose(flatPainter(S),"canvas")};
 const three=window.THREE?threePainter(S,()=>{plainly();all()}):null;
 three?choose(three,"three.js"):plainly();
 draws.push(()=>{const h=H,[c,w]=context(canvas,h),t=view.cursor===null?D.begin:view.cursor,k=Math.max(0,Math.min(R.t.length-1,Math.round((t-D.begin)/Math.max(D.end-D.begin,1e-300)*(R.t.length-1))));
  canvas.dataset.frame=k;const g=S.ghost=R.ghosts[ghost.value-1]||null;
  paint(c,w,h,S.scale0*S.zoom,k,arcAt(t).mode);
  c.fillStyle="#555";c.textAlign="left";c.fillText("t = "+show(t,4)+" s",8,16);
  if(g){const words="where it ends when the start is moved by ± "+R.ghostSize+" of "+g.name+", to first order:";c.fillText(words,8,h-10);
   let x=16+c.measureText(words).width;
   for(const [key,tint,sign] of GHOSTS)if(g[key]){c.fillStyle=tint;c.fillText("■ "+sign,x,h-10);x+=30}}})}

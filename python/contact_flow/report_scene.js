// SPDX-License-Identifier: BSD-3-Clause
// What moves: faces of all shapes, sorted by depth, on a plain canvas. No WebGL, which headless and remote browsers lack.
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
function figure(){const R=D.figure;if(!R.t){$("figure").remove();return}
 const canvas=$("robot"),flat=R.plane.length===2,points=[];let az=flat?-Math.PI/2:-1.1,el=R.plane==="xy"?Math.PI/2:flat?0:.25,zoom=1,drag=null,playing=null;
 R.poses.forEach(f=>f.forEach(p=>points.push(p)));R.contacts.forEach(f=>f.forEach(p=>{if(p[0]!==null)points.push(p)}));
 const bodies=R.shapes.map(s=>{const b=s.mesh||rounded(s.kind,s.size);return {link:s.link,colour:s.colour,two:!!s.mesh,f:b.f,v:b.v.map(p=>{const q=turned(s.turn,p);return [q[0]+s.at[0],q[1]+s.at[1],q[2]+s.at[2]]})}});
 bodies.forEach(b=>{const p=R.poses[0][b.link],m=matrix(p.slice(3,7));b.v.forEach(v=>points.push(turned(m,v).map((x,k)=>x+p[k])))});   // where it begins, as a whole
 const lo=[0,1,2].map(i=>points.reduce((m,p)=>Math.min(m,p[i]),Infinity)),hi=[0,1,2].map(i=>points.reduce((m,p)=>Math.max(m,p[i]),-Infinity));
 const mid=lo.map((v,i)=>(v+hi[i])/2),span=Math.max(...hi.map((v,i)=>v-lo[i]),.05);canvas.dataset.span=span;
 let most=1e-12;for(const f of R.contacts)for(const p of f)if(p[3]!==null)most=Math.max(most,Math.hypot(p[3],p[4],p[5]));
 const ghost=make("select",undefined,$("ghosts"));[{name:"none"}].concat(R.ghosts).forEach((g,k)=>{const o=make("option",k?"± "+g.name:"no ghosts",ghost);o.value=k});
 if(R.ghosts.length){const name=D.derivative.directions[kinkiest(D.derivative.directions)].name;ghost.value=1+Math.max(0,R.ghosts.findIndex(g=>g.name===name))}else $("ghosts").hidden=true;
 ghost.addEventListener("change",()=>all());
 const speed=make("select",undefined,$("speed"));[1,.5,.2,.1,.02].forEach(s=>{const o=make("option",s+"×",speed);o.value=s});
 if(R.missing.length)$("missing").textContent=R.missing.join("; ");
 canvas.addEventListener("mousedown",e=>{drag=[e.offsetX,e.offsetY]});window.addEventListener("mouseup",()=>{drag=null});
 canvas.addEventListener("mousemove",e=>{if(!drag)return;az+=(e.offsetX-drag[0])*.01;el=Math.max(-1.5708,Math.min(1.5708,el+(e.offsetY-drag[1])*.01));drag=[e.offsetX,e.offsetY];all()});
 canvas.addEventListener("wheel",e=>{e.preventDefault();zoom=Math.max(.2,Math.min(30,zoom*Math.exp(-e.deltaY*.001)));all()},{passive:false});
 canvas.addEventListener("dblclick",()=>{zoom=1;all()});
 const stop=()=>{playing=null;$("play").textContent="play"};
 const step=now=>{if(!playing)return;const t=playing.t+(now-playing.now)/1000*Number(speed.value);if(t>=view.to){stop();setCursor(view.to);return}setCursor(t);requestAnimationFrame(step)};
 $("play").addEventListener("click",()=>{if(playing)return stop();const t=view.cursor===null||view.cursor>=view.to||view.cursor<view.from?view.from:view.cursor;playing={now:performance.now(),t};$("play").textContent="stop";requestAnimationFrame(step)});
 draws.push(()=>{const h=380,[c,w]=context(canvas,h),t=view.cursor===null?D.begin:view.cursor,k=Math.max(0,Math.min(R.t.length-1,Math.round((t-D.begin)/Math.max(D.end-D.begin,1e-300)*(R.t.length-1)))),s=.8*h/span*zoom;
  const ca=Math.cos(az),sa=Math.sin(az),ce=Math.cos(el),se=Math.sin(el);
  const V=p=>{const x=p[0]-mid[0],y=p[1]-mid[1],z=p[2]-mid[2],v=ca*x+sa*y;return [w/2+s*(ca*y-sa*x),h/2-s*(ce*z-se*v),s*(ce*v+se*z)]};
  const path=P=>{c.beginPath();P.forEach((p,i)=>i?c.lineTo(p[0],p[1]):c.moveTo(p[0],p[1]))};
  canvas.dataset.frame=k;
  c.lineWidth=1;R.terrain.forEach((g,i)=>{const n=g.length-1,m=R.moves.length?R.moves[i][k]:[0,0,0],G=g.map(r=>r.map(p=>V([p[0]+m[0],p[1]+m[1],p[2]+m[2]])));
   for(let i=0;i<n;i++)for(let j=0;j<n;j++){path([G[i][j],G[i+1][j],G[i+1][j+1],G[i][j+1]]);c.fillStyle=(i+j)%2?"#eceef0":"#e2e5e8";c.fill()}});
  c.lineCap="round";c.strokeStyle="#777";c.lineWidth=3;for(const l of R.walls){path(l.map(V));c.stroke()}
  const faces=[];
  const add=(pose,tint,alpha)=>bodies.forEach(b=>{const q=pose[b.link],m=matrix(q.slice(3)),P=b.v.map(p=>{const r=turned(m,p);return V([r[0]+q[0],r[1]+q[1],r[2]+q[2]])});
   b.f.forEach(f=>{const A=P[f[0]],B=P[f[1]],C=P[f[2]],u=[B[0]-A[0],B[1]-A[1],B[2]-A[2]],v=[C[0]-A[0],C[1]-A[1],C[2]-A[2]];
    let n=[u[1]*v[2]-u[2]*v[1],u[2]*v[0]-u[0]*v[2],u[0]*v[1]-u[1]*v[0]];const l=Math.hypot(...n)||1;n=n.map(x=>x/l);
    if(n[2]>0&&!b.two)return;const light=.45+.55*Math.abs(-.3*n[0]+.6*n[1]-.74*n[2]);
    faces.push({z:f.reduce((z,i)=>z+P[i][2],0)/f.length,P:f.map(i=>P[i]),colour:tint||b.colour,light,alpha})})});
  const sticks=(pose,colour)=>{c.strokeStyle=colour;c.lineWidth=2;pose.forEach((p,i)=>{if(R.parents[i]>=0){path([V(pose[R.parents[i]]),V(p)]);c.stroke()}})};
  const g=R.ghosts[ghost.value-1];
  if(g)for(const [key,tint] of [["up","#d95f02"],["down","#1f77b4"]])if(g[key])bodies.length?add(g[key],tint,.28):sticks(g[key],tint);
  if(R.plane){c.strokeStyle="#bbc";c.lineWidth=1;R.names.forEach((_,b)=>{path(R.poses.slice(0,k+1).map(f=>V(f[b])));c.stroke()})}
  sticks(R.poses[k],bodies.length?"#99a":"#333");if(bodies.length)add(R.poses[k],null,1);
  faces.sort((a,b)=>a.z-b.z);c.lineWidth=.6;
  for(const f of faces){const n=parseInt(f.colour.slice(1),16),rgb=[n>>16,n>>8&255,n&255].map(x=>Math.min(255,Math.round(f.alpha<1?x:x*f.light+34*f.light)));
   c.fillStyle=c.strokeStyle="rgba("+rgb+","+f.alpha+")";path(f.P);c.closePath();c.fill();if(f.alpha===1)c.stroke()}
  const arc=arcAt(t);
  R.contacts[k].forEach((p,i)=>{if(p[0]===null)return;const holds=arc.mode.includes(D.constraints[i]),a=V(p);
   c.fillStyle=c.strokeStyle=colour(i);c.lineWidth=1.5;c.beginPath();c.arc(a[0],a[1],holds?5:3.5,0,7);holds?c.fill():c.stroke();
   const f=[p[3],p[4],p[5]],size=Math.hypot(...f);if(!holds||!(size>1e-9*most))return;
   const b=V(p.slice(0,3).map((x,j)=>x+f[j]*.35*span/most)),l=Math.hypot(b[0]-a[0],b[1]-a[1]);if(l<2)return;
   c.lineWidth=2.5;path([a,b]);c.stroke();const e=[(b[0]-a[0])/l,(b[1]-a[1])/l];path([b,[b[0]-9*e[0]+4*e[1],b[1]-9*e[1]-4*e[0]],[b[0]-9*e[0]-4*e[1],b[1]-9*e[1]+4*e[0]]]);c.fill()});
  c.fillStyle="#555";c.textAlign="left";c.fillText("t = "+show(t,4)+" s",8,16);
  if(g){c.fillText("where it ends when the start is moved by ± "+R.ghostSize+" of "+g.name+", to first order:",8,h-10);
   let x=16+c.measureText("where it ends when the start is moved by ± "+R.ghostSize+" of "+g.name+", to first order:").width;
   for(const [key,tint,sign] of [["up","#d95f02","+"],["down","#1f77b4","−"]])if(g[key]){c.fillStyle=tint;c.fillText("■ "+sign,x,h-10);x+=30}}})}

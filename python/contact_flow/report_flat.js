// SPDX-License-Identifier: BSD-3-Clause
// What moves, without WebGL: faces of all shapes, sorted by depth, on a plain canvas. S is that of report_scene.js; paint has
// the context, its size, pixels a metre, the frame and the names of the contacts that hold.
function flatPainter(S){const R=S.figure,bodies=S.bodies;
 return function paint(c,w,h,s,k,mode){const [right,up,back]=axes(S),dot=(a,p)=>a[0]*p[0]+a[1]*p[1]+a[2]*p[2];
  const V=p=>{const r=[p[0]-S.at[0],p[1]-S.at[1],p[2]-S.at[2]];return [w/2+s*dot(right,r),h/2-s*dot(up,r),s*dot(back,r)]};
  const path=P=>{c.beginPath();P.forEach((p,i)=>i?c.lineTo(p[0],p[1]):c.moveTo(p[0],p[1]))};
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
  const g=S.ghost;
  if(g)for(const [key,tint] of GHOSTS)if(g[key])bodies.length?add(g[key],tint,.28):sticks(g[key],tint);
  if(R.plane){c.strokeStyle="#bbc";c.lineWidth=1;R.names.forEach((_,b)=>{path(R.poses.slice(0,k+1).map(f=>V(f[b])));c.stroke()})}
  sticks(R.poses[k],bodies.length?"#99a":"#333");if(bodies.length)add(R.poses[k],null,1);
  faces.sort((a,b)=>a.z-b.z);c.lineWidth=.6;
  for(const f of faces){const n=parseInt(f.colour.slice(1),16),rgb=[n>>16,n>>8&255,n&255].map(x=>Math.min(255,Math.round(f.alpha<1?x:x*f.light+34*f.light)));
   c.fillStyle=c.strokeStyle="rgba("+rgb+","+f.alpha+")";path(f.P);c.closePath();c.fill();if(f.alpha===1)c.stroke()}
  R.contacts[k].forEach((p,i)=>{if(p[0]===null)return;const holds=mode.includes(D.constraints[i]),a=V(p),arrow=S.arrow(p,holds);
   c.fillStyle=c.strokeStyle=colour(i);c.lineWidth=1.5;c.beginPath();c.arc(a[0],a[1],holds?5:3.5,0,7);holds?c.fill():c.stroke();
   if(!arrow)return;const b=V(arrow[1]),l=Math.hypot(b[0]-a[0],b[1]-a[1]);if(l<2)return;
   c.lineWidth=2.5;path([a,b]);c.stroke();const e=[(b[0]-a[0])/l,(b[1]-a[1])/l];path([b,[b[0]-9*e[0]+4*e[1],b[1]-9*e[1]-4*e[0]],[b[0]-9*e[0]-4*e[1],b[1]-9*e[1]+4*e[0]]]);c.fill()})}}

// SPDX-License-Identifier: BSD-3-Clause
// What moves, by three.js (r111), on a canvas below that of the captions. S and paint are those of report_flat.js. Null without WebGL;
// lost() is called when the browser takes it away.
function threePainter(S,lost){const T=window.THREE,R=S.figure,above=$("robot"),page=document.createElement("canvas");
 const gl=page.getContext("webgl",{alpha:true,antialias:true});if(!gl)return null;
 const renderer=new T.WebGLRenderer({canvas:page,context:gl,alpha:true,antialias:true});renderer.setClearColor(0xffffff,0);
 page.addEventListener("webglcontextlost",e=>{e.preventDefault();page.remove();lost()});
 page.style.cssText="position:absolute;pointer-events:none;width:auto";above.style.position="relative";above.parentNode.insertBefore(page,above);
 const scene=new T.Scene(),reach=20*Math.max(S.span,1),camera=new T.OrthographicCamera(-1,1,1,-1,0,2*reach);
 scene.add(new T.AmbientLight(0xffffff,.62));const sun=new T.DirectionalLight(0xffffff,.5);scene.add(sun,sun.target);
 const plain=(colour,more)=>new T.MeshBasicMaterial(Object.assign({color:colour},more)),vector=p=>new T.Vector3(p[0],p[1],p[2]);
 const place=(object,p)=>{object.position.set(p[0],p[1],p[2]);object.quaternion.set(p[4],p[5],p[6],p[3])};   // (x, w x y z)
 function corners(v,f){   // faces as triangles of their own, with normals of their own
  const flat=[];for(const face of f)for(let i=2;i<face.length;i++)for(const k of [face[0],face[i-1],face[i]])flat.push(...v[k]);
  const geometry=new T.BufferGeometry();geometry.setAttribute("position",new T.BufferAttribute(new Float32Array(flat),3));geometry.computeVertexNormals();return geometry}
 function solid(b){const s=b.shape,z=s.size;if(s.mesh)return corners(b.v,b.f);   // in the frame of its link
  const geometry=s.kind==="box"?new T.BoxBufferGeometry(...z):s.kind==="cylinder"?new T.CylinderBufferGeometry(z[0],z[0],z[1],32).rotateX(Math.PI/2):new T.SphereBufferGeometry(z[0],32,20);
  const m=s.turn,a=s.at;return geometry.applyMatrix(new T.Matrix4().set(m[0],m[1],m[2],a[0],m[3],m[4],m[5],a[1],m[6],m[7],m[8],a[2],0,0,0,1))}
 // A round bar from a to b, of a radius in metres; its ends may be set again.
 const UP=new T.Vector3(0,1,0),bar=new T.CylinderBufferGeometry(1,1,1,10).translate(0,.5,0);
 function between(object,a,b,radius){const d=vector(b).sub(vector(a)),length=d.length();object.visible=length>1e-9;if(!object.visible)return;
  object.position.copy(vector(a));object.quaternion.setFromUnitVectors(UP,d.divideScalar(length));object.scale.set(radius,length,radius)}
 const pixel=1/S.scale0;   // of the first view [m]
 // A figure: shapes by their links, or bars between links that have none.
 const solids=S.bodies.map(solid);
 function make(paints,stick){const group=new T.Group(),meshes=S.bodies.map((b,k)=>new T.Mesh(solids[k],paints(b)));
  const bars=R.parents.map(parent=>parent<0?null:new T.Mesh(bar,stick));group.add(...meshes,...bars.filter(Boolean));scene.add(group);
  return {group,pose(pose){meshes.forEach((m,k)=>place(m,pose[S.bodies[k].link]));bars.forEach((b,i)=>{if(b)between(b,pose[R.parents[i]],pose[i],pixel)})}}}
 const robot=make(b=>new T.MeshLambertMaterial({color:b.colour,side:b.two?T.DoubleSide:T.FrontSide}),plain(S.bodies.length?"#9999aa":"#333333"));
 const ghosts={};for(const [key,tint] of GHOSTS){const bare=!S.bodies.length,through={transparent:true,opacity:.28,depthWrite:false};
  ghosts[key]=make(b=>plain(tint,Object.assign({side:b.two?T.DoubleSide:T.FrontSide},through)),plain(tint,bare?{}:{visible:false}))}
 // Fields of the terrain, seen from above: from below one looks through.
 const grounds=R.terrain.map(g=>{const n=g.length-1,where=[],tints=[],light=new T.Color("#eceef0"),dark=new T.Color("#e2e5e8");
  const a=vector(g[1][0]).sub(vector(g[0][0])),over=a.cross(vector(g[0][1]).sub(vector(g[0][0]))).z>0;
  for(let i=0;i<n;i++)for(let j=0;j<n;j++){const q=[g[i][j],g[i+1][j],g[i+1][j+1],g[i][j+1]];if(!over)q.reverse();
   for(const k of [0,1,2,0,2,3]){where.push(...q[k]);((i+j)%2?light:dark).toArray(tints,tints.length)}}
  const geometry=new T.BufferGeometry();geometry.setAttribute("position",new T.BufferAttribute(new Float32Array(where),3));
  geometry.setAttribute("color",new T.BufferAttribute(new Float32Array(tints),3));
  const mesh=new T.Mesh(geometry,new T.MeshBasicMaterial({vertexColors:T.VertexColors,polygonOffset:true,polygonOffsetFactor:1,polygonOffsetUnits:1}));scene.add(mesh);return mesh});
 const wall=plain("#777777");R.walls.forEach(l=>{const b=new T.Mesh(bar,wall);between(b,l[0],l[1],1.5*pixel);scene.add(b)});
 const traces=R.plane?R.names.map((_,b)=>{const geometry=new T.BufferGeometry().setFromPoints(R.poses.map(f=>vector(f[b])));
  const line=new T.Line(geometry,new T.LineBasicMaterial({color:"#bbbbcc"}));line.frustumCulled=false;scene.add(line);return geometry}):[];
 // Contacts and forces, before all else and as large on any scale.
 const dot=new T.SphereBufferGeometry(1,16,12),ring=new T.RingBufferGeometry(2.75/3.5,4.25/3.5,24),tip=new T.ConeBufferGeometry(1,1,14).translate(0,-.5,0);
 const marks=R.contacts[0].map((_,i)=>{const paint=plain(colour(i),{depthTest:false,transparent:true}),part=g=>{const m=new T.Mesh(g,paint);m.renderOrder=1;m.frustumCulled=false;scene.add(m);return m};
  return {dot:part(dot),ring:part(ring),shaft:part(bar),tip:part(tip)}});
 function mark(m,p,holds,s){for(const k in m)m[k].visible=false;if(p[0]===null)return;
  const spot=holds?m.dot:m.ring;spot.visible=true;spot.position.set(p[0],p[1],p[2]);spot.scale.setScalar((holds?5:3.5)/s);spot.quaternion.copy(camera.quaternion);
  const arrow=S.arrow(p,holds);if(!arrow)return;const [a,b]=arrow,d=vector(b).sub(vector(a)),length=d.length(),head=Math.min(9/s,length);
  if(length*s<2)return;d.divideScalar(length);
  between(m.shaft,a,vector(b).addScaledVector(d,-head).toArray(),1.25/s);
  m.tip.visible=true;m.tip.position.copy(vector(b));m.tip.quaternion.setFromUnitVectors(UP,d);m.tip.scale.set(4/s,head,4/s)}
 return function paint(c,w,h,s,k,mode){const [right,up,back]=axes(S),at=vector(S.at);
  renderer.setPixelRatio(window.devicePixelRatio||1);renderer.setSize(w,h,false);page.style.width=w+"px";page.style.height=h+"px";
  Object.assign(camera,{left:-w/(2*s),right:w/(2*s),top:h/(2*s),bottom:-h/(2*s)});camera.updateProjectionMatrix();
  camera.up.copy(vector(up));camera.position.copy(at).addScaledVector(vector(back),reach);camera.lookAt(at);
  sun.target.position.copy(at);sun.position.copy(at).addScaledVector(vector(right),-.3*reach).addScaledVector(vector(up),.6*reach).addScaledVector(vector(back),.74*reach);
  grounds.forEach((g,i)=>{if(R.moves.length)g.position.copy(vector(R.moves[i][k]))});
  robot.pose(R.poses[k]);traces.forEach(g=>g.setDrawRange(0,k+1));
  for(const [key] of GHOSTS){const there=S.ghost&&S.ghost[key];ghosts[key].group.visible=!!there;if(there)ghosts[key].pose(there)}
  R.contacts[k].forEach((p,i)=>mark(marks[i],p,mode.includes(D.constraints[i]),s));
  renderer.render(scene,camera)}}

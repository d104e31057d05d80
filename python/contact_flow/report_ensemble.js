function frame(c,w,h,[xl,xh],[yl,yh],xname,yname){const X=v=>LEFT+(v-xl)/(xh-xl)*(w-LEFT-8),Y=v=>(h-48)*(1-(v-yl)/(yh-yl))+18;
 const [xs,sx]=ticks(xl,xh,6),[ys,sy]=ticks(yl,yh,5);c.fillStyle="#555";c.strokeStyle="#ccc";c.textAlign="center";
 for(const v of xs){c.beginPath();c.moveTo(X(v),h-30);c.lineTo(X(v),h-26);c.stroke();c.fillText(label(v,sx),X(v),h-14)}
 c.textAlign="right";for(const v of ys){c.beginPath();c.moveTo(LEFT-4,Y(v));c.lineTo(LEFT,Y(v));c.stroke();c.fillText(label(v,sy),LEFT-6,Y(v)+4)}
 c.strokeRect(LEFT,18,w-LEFT-8,h-48);c.textAlign="right";c.fillText(xname,w-8,h-2);c.textAlign="left";c.fillText(yname,LEFT,12);return [X,Y]}
function basinMap(E){const B=E.basin;if(!B){$("basin").remove();$("basin-legend").textContent=E.basin_refused;return}
 const grey="#999",of=k=>k<B.labels.length?colour(k):grey;
 draws.push(()=>{const h=380,[c,w]=context($("basin"),h),[X,Y]=frame(c,w,h,B.limits[0],B.limits[1],B.x,B.y),n=B.bins,dx=(w-LEFT-8)/n,dy=(h-48)/n;
  for(let i=0;i<n;i++)for(let j=0;j<n;j++){const k=B.cells[i*n+j];if(k<0)continue;c.fillStyle=of(k);c.fillRect(LEFT+i*dx,18+(n-1-j)*dy,dx+.5,dy+.5)}});
 B.labels.forEach((name,k)=>{const s=make("span","■ "+name+": "+show(100*B.shares[k],3)+" %   ",$("basin-legend"));s.style.color=of(k)});
 if(B.others)make("span","■ "+B.others+" more",$("basin-legend")).style.color=grey}
function spread(E){if(!E.distributions.length){$("spread").remove();return}
 const by=make("select",undefined,make("span","of ",$("spread-of")));
 const draw=()=>{const S=E.distributions[by.value],h=240,[c,w]=context($("spread"),h),e=S.edges,top=Math.max(...S.density,...(S.predicted||[0]))*1.1||1;
  const [X,Y]=frame(c,w,h,[e[0],e[e.length-1]],[0,top],S.name+", from the run without draws","density");
  c.fillStyle="#bbb";S.density.forEach((d,k)=>c.fillRect(X(e[k]),Y(d),X(e[k+1])-X(e[k])+.5,Y(0)-Y(d)));
  if(!S.predicted)return;c.strokeStyle="#d95f02";c.lineWidth=1.6;c.beginPath();c.moveTo(X(e[0]),Y(0));
  S.predicted.forEach((d,k)=>{c.lineTo(X(e[k]),Y(d));c.lineTo(X(e[k+1]),Y(d))});c.lineTo(X(e[e.length-1]),Y(0));c.stroke()};
 options(by,E.distributions.map(S=>S.name),E.chosen,draw);draws.push(draw);$("spread-words").textContent=E.prediction}
function wordTree(E){draws.push(()=>{const h=300,[c,w]=context($("tree"),h),arcs=Math.max(1,...E.branches.map(b=>b.arc+1)),step=(w-20)/arcs,X=a=>10+a*step,Y=s=>(h-24)*(1-s)+4,box=.55*step;
 for(const b of E.branches){const y=Y(b.bottom+b.share),t=(h-24)*b.share,m=Y(b.bottom+b.share/2);
  if(b.parent!==null){c.strokeStyle="#aaa";c.lineWidth=.5+6*b.share;c.beginPath();c.moveTo(X(b.arc-1)+box,Y(b.parent));c.lineTo(X(b.arc),m);c.stroke()}
  c.globalAlpha=.4;c.fillStyle=colour(b.arc);c.fillRect(X(b.arc),y,box,Math.max(t,1));c.globalAlpha=1;
  if(t>11){c.fillStyle="#222";c.textAlign="center";c.fillText(b.word+" "+Math.round(100*b.share)+" %",X(b.arc)+box/2,m+4)}}
 c.fillStyle="#555";c.textAlign="center";for(let a=0;a<arcs;a++)c.fillText("arc "+(a+1),X(a)+box/2,h-4)})}
function ensemble(){const E=D.ensemble;if(!E){$("ensemble").remove();return}
 $("ensemble-words").textContent=E.summary;basinMap(E);spread(E);wordTree(E)}

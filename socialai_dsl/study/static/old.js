// @ts-check
/* Says what the page needs where a browser cannot show it: one that knows no modules, cannot read our scripts, or lacks what they use.
   It is written for browsers of any age, and looks when all others have run. */
window.onload = function () {
  var body = document.body, canvas = document.createElement("canvas"), told = document.createElement("p");
  var able = "WebSocket" in window && "FormData" in window && !!canvas.getContext && "replaceChildren" in body && "flatMap" in [];
  if (able && document.querySelector(".study")) return;
  while (body.firstChild) body.removeChild(body.firstChild);
  told.setAttribute("role", "alert");
  told.appendChild(document.createTextNode(JSON.parse(body.getAttribute("data-words") || "{}").script));
  body.appendChild(told);
};

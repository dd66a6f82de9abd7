/* For browsers that know no modules: say which one is needed. */
document.body.appendChild(document.createTextNode(JSON.parse(document.body.getAttribute("data-words") || "{}").script));

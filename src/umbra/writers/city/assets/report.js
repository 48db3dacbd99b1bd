// A click on an area's row shows it on the map.
dressTables((kind, index) => {
  for (const area of document.querySelectorAll(".area.chosen")) area.classList.remove("chosen");
  const chosen = document.getElementById(`area-${index}`);
  if (!chosen) return;
  chosen.classList.add("chosen");
  chosen.parentNode.append(chosen);
  document.querySelector(".city-map").scrollIntoView({ block: "nearest" });
});

// True is blue and false vermilion (Okabe and Ito), told apart with every common colour blindness; no agent has either.
const LIGHT = {
  agents: ["#6a3d9a", "#009e73", "#b8478f", "#8a6d00", "#2aa0c8", "#444444", "#7a3b12", "#5f8f00"],
  paper: "#f1f1ef",
  floor: "#ffffff",
  grid: "#ececec",
  ink: "#222222",
  faint: "#767676",
  region: ["#cfe3f1", "#f8ddcb", "#d5ebdd", "#ead9e7", "#f7ebc3", "#e3e1f2", "#dde9c6", "#e8e3d3"],
  outline: ["#7fafcf", "#dda17e", "#84bf9c", "#be93b5", "#d3bc62", "#a5a0cf", "#a5bf74", "#b3a988"],
  obstacle: "#5b6066",
  onObstacle: "#ffffff",
  holds: "#0072b2",
  fails: "#d55e00",
  open: "#b9c4cc",
  link: "#6a7680",
  route: "#111111",
};

const DARK = {
  agents: ["#b69be0", "#2fc79a", "#e88fc4", "#e6c34a", "#7fdcf0", "#c8c8c8", "#c99a76", "#a9d15a"],
  paper: "#15181b",
  floor: "#1e2327",
  grid: "#2a3036",
  ink: "#eceff1",
  faint: "#98a2aa",
  region: ["#1f3d52", "#4c3020", "#1f4433", "#44304a", "#474018", "#323152", "#37451d", "#413c2b"],
  outline: ["#4d86ad", "#a86b45", "#4d9470", "#946a90", "#9a8838", "#7672ad", "#7a934a", "#8a8062"],
  obstacle: "#8b949b",
  onObstacle: "#15181b",
  holds: "#56b4e9",
  fails: "#f08a3c",
  open: "#4a545c",
  link: "#8b98a3",
  route: "#ffffff",
};

const colourOf = (palette, agent) => palette.agents[agent % palette.agents.length];

// The palette comes with the page (palette.py); here is who has which colour and mark.
const { light: LIGHT, dark: DARK, marks: MARKS } = PALETTE;

// Each of few agents has a colour and a mark of its own, of many each team.
const colourOf = (palette, style) => palette.agents[style % palette.agents.length];
const markOf = (style) => MARKS[(style + 3 * Math.floor(style / MARKS.length)) % MARKS.length];
const EFFECTS = ["absent", "helps", "harms", "neither", "open"];

// A bar of a round length, for what one measures in a picture.

const FONT = "500 12px system-ui, -apple-system, sans-serif";
const LONGEST = 130; // [CSS pixels]

/**
 * The longest of 1, 2 and 5 times a power of ten that a bar shows.
 * @param {number} metres a CSS pixel
 */
export const findBar = (metres) => {
  const most = LONGEST * metres,
    ten = 10 ** Math.floor(Math.log10(most));
  return ten * (most >= 5 * ten ? 5 : most >= 2 * ten ? 2 : 1);
};

/**
 * Draw the bar over the foot of a picture.
 * @param {CanvasRenderingContext2D} pen a unit is a CSS pixel
 * @param {number} metres a CSS pixel
 * @param {boolean} isEverywhere whether it holds in all of the picture, as in a plan
 * @param {number} x @param {number} foot
 */
export const drawScale = (pen, metres, isEverywhere, x, foot) => {
  const length = findBar(metres),
    wide = length / metres,
    size = length >= 1000 ? `${length / 1000} km` : `${length} m`,
    words = isEverywhere ? size : `${size} in the middle`;
  pen.save();
  pen.font = FONT;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  const room = Math.max(wide, pen.measureText(words).width) + 16,
    middle = x + room / 2,
    left = middle - wide / 2;
  pen.fillStyle = "rgba(255, 255, 255, 0.88)";
  pen.fillRect(middle - room / 2, foot - 32, room, 32);
  pen.fillStyle = "#1c1c22";
  pen.fillText(words, middle, foot - 22);
  pen.fillRect(left, foot - 8, wide, 2);
  pen.fillRect(left, foot - 13, 2, 7);
  pen.fillRect(left + wide - 2, foot - 13, 2, 7);
  pen.restore();
};

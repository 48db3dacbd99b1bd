// Numbers that Python packed as text (writers/packing.py): deflated, in base64.

/**
 * Decode base64.
 * @param {string} text
 */
export const decode = (text) => {
  const letters = atob(text.trim()),
    bytes = new Uint8Array(letters.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = letters.charCodeAt(i);
  return bytes;
};

/** @param {string} text */
export const inflate = async (text) => {
  const stream = new Blob([decode(text)]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer();
};

/**
 * Unpack whole numbers, each packed as its difference to the one before.
 * @param {string} text
 */
export const unpack = async (text) => {
  const values = new Int32Array(await inflate(text));
  for (let i = 1; i < values.length; i++) values[i] += values[i - 1];
  return values;
};

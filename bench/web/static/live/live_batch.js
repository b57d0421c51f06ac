// Binary form of a live batch: header, then the channels one after the other.

const SCHEMA = 1;
const HEADER_BYTES = 24;

/**
 * Returns a batch of an array buffer: sequence number, UTC of the first sample [s], period [s], number of samples, and
 * a column for each channel by name. `channels` lists the channels in their order; `offset` is the place of the batch.
 */
export function parseBatch(buffer, channels, offset = 0) {
  const view = new DataView(buffer, offset);
  if (view.getUint32(0, true) !== SCHEMA) throw new Error("The service sends samples of another version: reload the page.");
  const count = view.getUint32(16, true);
  const columns = {};
  channels.forEach(({ name }, k) => {
    columns[name] = new Float32Array(buffer, offset + HEADER_BYTES + 4 * k * count, count);
  });
  return {
    sequence: view.getUint32(4, true), utc: view.getFloat64(8, true), period: view.getFloat32(20, true), count, columns,
    bytes: HEADER_BYTES + 4 * count * channels.length,
  };
}

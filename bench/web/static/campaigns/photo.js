// Photos of a person as base64, small enough for one request.

/** Largest file [byte] that is sent as it is; a request has at most 4 MiB, and base64 needs a third more. */
const MAX_BYTES = 2_500_000;
const LARGEST_SIDE = 2_000;
const ACCEPTED = ["image/jpeg", "image/png"];

/** Returns a photo as base64; a large one is reduced to 2000 pixels. */
export async function encodePhoto(file) {
  const isSmall = file.size <= MAX_BYTES && ACCEPTED.includes(file.type);
  return toBase64(isSmall ? file : await reduce(file));
}

async function reduce(file) {
  const image = await createImageBitmap(file).catch(() => {
    throw new Error(`${file.name} is no photo that this browser can read; give a JPEG or PNG file.`);
  });
  const scale = Math.min(1, LARGEST_SIDE / Math.max(image.width, image.height));
  const canvas = new OffscreenCanvas(Math.round(image.width * scale), Math.round(image.height * scale));
  canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
  return canvas.convertToBlob({ type: "image/jpeg", quality: 0.85 });
}

function toBase64(blob) {
  return new Promise((resolve, reject) => {
    const reader = new FileReader();
    reader.addEventListener("load", () => resolve(reader.result.split(",")[1]));
    reader.addEventListener("error", () => reject(reader.error));
    reader.readAsDataURL(blob);
  });
}

/** Asks the server. */

/** @type {number | null} the number of the viewer whose stacks the page shows, once it is known */
let shown = null;

/**
 * Asks for these stacks alone from here on: the server refuses once it shows others.
 * @param {number} number
 */
export function showOnly(number) {
  shown = number;
}

/**
 * Returns what the server answers as JSON.
 * @param {string} path
 * @param {AbortSignal} [signal]
 * @returns {Promise<any>}
 * @throws {Error} with a sentence for people
 */
export async function get(path, signal) {
  return (await ask(path, signal)).json();
}

/**
 * Returns the server's answer, if it is a good one.
 * @param {string} path
 * @param {AbortSignal} [signal]
 * @param {RequestInit} [request] its method and body, if it is not GET
 * @returns {Promise<Response>}
 * @throws {Error} with a sentence for people, and the status of the answer
 */
export async function ask(path, signal, request) {
  const of = shown == null ? "" : `${path.includes("?") ? "&" : "?"}of=${shown}`;
  const answer = await fetch(`${path}${of}`, { ...request, signal }).catch((error) => {
    if (error.name === "AbortError") throw error;
    throw new Error("The viewer does not answer. Is lamp view still running?");
  });
  if (answer.ok) return answer;
  const told = await answer.json().catch(() => ({ error: `status ${answer.status}` }));
  const error = new Error(`${told.error[0].toUpperCase()}${told.error.slice(1)}.`);
  throw Object.assign(error, { status: answer.status });
}

/**
 * Asks again and again until work in the background has ended.
 * @param {string} path
 * @param {(state: any) => void} tell is given each answer
 */
export async function poll(path, tell) {
  for (;;) {
    const state = await get(path);
    tell(state);
    if (state.status !== "running") return;
    await new Promise((done) => setTimeout(done, 500));
  }
}

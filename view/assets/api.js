/** Asks the server. */

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
 * @returns {Promise<Response>}
 * @throws {Error} with a sentence for people
 */
export async function ask(path, signal) {
  const answer = await fetch(path, { signal }).catch((error) => {
    if (error.name === "AbortError") throw error;
    throw new Error("The viewer does not answer. Is lamp view still running?");
  });
  if (answer.ok) return answer;
  const told = await answer.json().catch(() => ({ error: `status ${answer.status}` }));
  throw new Error(`${told.error[0].toUpperCase()}${told.error.slice(1)}.`);
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

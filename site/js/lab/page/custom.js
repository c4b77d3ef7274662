/** placeholder until written */
export async function mountCustom() { throw new Error('not yet') }

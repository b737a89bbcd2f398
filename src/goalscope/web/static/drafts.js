/**
 * What somebody types, kept in this tab until it is sent: it outlives a reload and other pages.
 * @param {string} key
 */
export function drafts(key) {
  const guarded = (work) => {
    try {
      return work();
    } catch {
      return null; // storage that is switched off or full
    }
  };
  return {
    read: () => guarded(() => JSON.parse(sessionStorage.getItem(key))),
    write: (draft) => guarded(() => sessionStorage.setItem(key, JSON.stringify(draft))),
    drop: () => guarded(() => sessionStorage.removeItem(key)),
  };
}

//! Two lists of cells in the same order, read side by side.

use std::collections::BTreeMap;

/// Pairs each item with the entry of its place, `None` if there is none. Both lists are sorted by place; an entry pairs once.
///
/// ```
/// use std::collections::BTreeMap;
///
/// let known = BTreeMap::from([((0, 1), 'a'), ((0, 3), 'b')]);
/// let found: Vec<_> = scene_model::publish::in_step(&known, [(0, 0), (0, 3)], |&place| place).collect();
/// assert_eq!(found, [((0, 0), None), ((0, 3), Some(&'b'))]);
/// ```
pub fn in_step<'a, T, V>(
    entries: impl IntoIterator<Item = (&'a (i32, i32), V)>,
    items: impl IntoIterator<Item = T>,
    place: impl Fn(&T) -> (i32, i32),
) -> impl Iterator<Item = (T, Option<V>)> {
    let mut entries = entries.into_iter().peekable();
    items.into_iter().map(move |item| {
        let wanted = place(&item);
        while entries.next_if(|(at, _)| **at < wanted).is_some() {}
        let found = entries.next_if(|(at, _)| **at == wanted).map(|(_, value)| value);
        (item, found)
    })
}

/// Updates the entry of each item's place; a place without one gets that of `fresh`. Both are sorted by place.
pub fn update_in_step<T, V>(
    entries: &mut BTreeMap<(i32, i32), V>,
    items: impl IntoIterator<Item = T>,
    place: impl Fn(&T) -> (i32, i32),
    fresh: impl Fn(&T) -> V,
    mut update: impl FnMut(&mut V, T),
) {
    let mut missing = Vec::new();
    for (item, entry) in in_step(entries.iter_mut(), items, &place) {
        match entry {
            Some(entry) => update(entry, item),
            None => missing.push(item),
        }
    }
    for item in missing {
        let entry = entries.entry(place(&item)).or_insert_with(|| fresh(&item));
        update(entry, item);
    }
}

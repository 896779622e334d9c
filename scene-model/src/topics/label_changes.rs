//! The label changes of one phase, from the kernels to the global counts.

/// A word that was resampled from label slot `old` to `new`; `old` is above every slot for a word without a label.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LabelChange {
    pub(crate) word: u32,
    pub(crate) old: u16,
    pub(crate) new: u16,
}

/// A buffer that is written without branches: entries at or past `len` are scrap.
#[derive(Clone, Debug, Default)]
pub(crate) struct LabelChanges {
    buffer: Vec<LabelChange>,
    len: usize,
}

impl LabelChanges {
    /// Makes room for `count` more entries, which [`Self::record`] needs.
    pub(crate) fn reserve(&mut self, count: usize) {
        if self.buffer.len() < self.len + count {
            self.buffer.resize((self.len + count).next_power_of_two(), LabelChange::default());
        }
    }

    /// Writes an entry, and keeps it if the label differs.
    #[inline(always)]
    pub(crate) fn record(&mut self, change: LabelChange) {
        self.buffer[self.len] = change;
        self.len += usize::from(change.old != change.new);
    }

    /// Returns all kept entries and empties the buffer.
    pub(crate) fn take(&mut self) -> &[LabelChange] {
        &self.buffer[..std::mem::take(&mut self.len)]
    }
}

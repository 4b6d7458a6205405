//! Fuzzed bytes, taken one value after the other; past their end everything is zero.

/// The bytes that are left.
#[derive(Clone, Copy, Debug)]
pub struct Input<'a>(pub &'a [u8]);

impl<'a> Input<'a> {
    pub fn array<const N: usize>(&mut self) -> [u8; N] {
        let mut array = [0; N];
        for byte in &mut array {
            *byte = self.byte();
        }
        array
    }

    pub fn byte(&mut self) -> u8 {
        let Some((&byte, rest)) = self.0.split_first() else {
            return 0;
        };
        self.0 = rest;
        byte
    }

    pub fn number(&mut self) -> u16 {
        u16::from_le_bytes(self.array())
    }

    /// As many bytes as there are, up to `len`.
    pub fn bytes(&mut self, len: usize) -> &'a [u8] {
        let (bytes, rest) = self.0.split_at(len.min(self.0.len()));
        self.0 = rest;
        bytes
    }

    /// `len` bytes: what is left, again and again.
    pub fn repeated(&self, len: usize) -> Vec<u8> {
        let mut bytes = vec![0; len];
        for target in bytes.chunks_mut(self.0.len().max(1)) {
            let len = target.len().min(self.0.len());
            target[..len].copy_from_slice(&self.0[..len]);
        }
        bytes
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

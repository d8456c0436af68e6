// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace velatura::usd::layer {

/// Finds objects that live elsewhere by hash: open addressing, so that a look-up misses the cache
/// once and growing does not touch the objects. Hashes must be well mixed; nothing is removed.
template <class T>
class PointerTable {
  public:
    size_t size() const { return size_; }

    /// The object of this hash for which is_it(object) holds, else nullptr.
    template <class IsIt>
    T* find(uint64_t hash, const IsIt& is_it) const {
        if (slots_.empty()) return nullptr;
        const size_t mask = slots_.size() - 1;
        for (size_t at = size_t(hash) & mask; slots_[at].object; at = (at + 1) & mask) {
            if (slots_[at].hash == hash && is_it(*slots_[at].object)) return slots_[at].object;
        }
        return nullptr;
    }

    /// Adds an object that find() does not find.
    void insert(uint64_t hash, T* object) {
        if ((size_ + 1) * 4 > slots_.size() * 3) grow(slots_.empty() ? 16 : slots_.size() * 2);
        place({hash, object});
        ++size_;
    }

    /// Makes room for `count` objects in all.
    void reserve(size_t count) {
        size_t capacity = 16;
        while (capacity * 3 < count * 4) capacity *= 2;
        if (capacity > slots_.size()) grow(capacity);
    }

  private:
    struct Slot {
        uint64_t hash = 0;
        T* object = nullptr;
    };

    void place(const Slot& slot) {
        const size_t mask = slots_.size() - 1;
        size_t at = size_t(slot.hash) & mask;
        while (slots_[at].object) at = (at + 1) & mask;
        slots_[at] = slot;
    }

    void grow(size_t capacity) {
        std::vector<Slot> old(capacity);
        old.swap(slots_);
        for (const Slot& slot : old) {
            if (slot.object) place(slot);
        }
    }

    std::vector<Slot> slots_;
    size_t size_ = 0;
};

}  // namespace velatura::usd::layer

#pragma once
// Hash table from 64-bit keys to numbers, for many look-ups: open addressing with linear probing.
#include <cstddef>
#include <cstdint>
#include <vector>

namespace lumigraft::reconstruct {

class CellTable {
 public:
  /// The number of a key; -1: not found.
  int find(std::uint64_t key) const {
    if (slots_.empty()) return -1;
    for (std::size_t at = home(key);; at = (at + 1) & (slots_.size() - 1)) {
      const Slot& slot = slots_[at];
      if (slot.number < 0 || slot.key == key) return slot.number;
    }
  }

  void clear() {
    slots_.clear();
    count_ = 0;
  }

  /// False if the key exists; its number is kept. `number` must not be negative.
  bool insert(std::uint64_t key, int number) {
    if (2 * (count_ + 1) > slots_.size()) grow();
    std::size_t at = home(key);
    for (; slots_[at].number >= 0; at = (at + 1) & (slots_.size() - 1)) {
      if (slots_[at].key == key) return false;
    }
    slots_[at] = {key, number};
    ++count_;
    return true;
  }

 private:
  struct Slot {
    std::uint64_t key = 0;
    int number = -1;
  };

  /// Fibonacci hashing (Knuth 1998, 6.4): the product's upper half depends on every bit of the key.
  std::size_t home(std::uint64_t key) const { return (key * 0x9e3779b97f4a7c15u) >> 32 & (slots_.size() - 1); }

  void grow() {
    std::vector<Slot> before(slots_.empty() ? kMinSlots : 2 * slots_.size());
    before.swap(slots_);
    count_ = 0;
    for (const Slot& slot : before) {
      if (slot.number >= 0) insert(slot.key, slot.number);
    }
  }

  static constexpr std::size_t kMinSlots = 1024;
  std::vector<Slot> slots_;  ///< a power of two
  std::size_t count_ = 0;
};

}  // namespace lumigraft::reconstruct

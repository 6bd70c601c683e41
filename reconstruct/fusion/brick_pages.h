#pragma once
// Memory pool of bricks. Every frame frees and allocates hundreds of them; a pool in huge pages is faster than the
// general allocator, and its memory is reused as a whole.
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <vector>

#include "reconstruct/field/distance_field.h"

namespace lumigraft::reconstruct {

constexpr std::size_t kPage_bytes = std::size_t{2} << 20;  ///< of a huge page
/// kPage_bytes of memory, in a huge page if the kernel grants it; to be released by FreePage.
void* allocate_page();
struct FreePage {
  void operator()(void* page) const { std::free(page); }
};

/// Pool of slots of one size. Thread-safe: threads that release a field free slots while another publishes.
class BrickPages {
 public:
  explicit BrickPages(std::size_t slot_bytes);
  BrickPages(const BrickPages&) = delete;
  BrickPages& operator=(const BrickPages&) = delete;

  void* allocate();
  void deallocate(void* slot);
  std::size_t used_bytes() const;  ///< by slots that are not free

 private:
  std::size_t slot_bytes_;
  mutable std::mutex mutex_;
  std::vector<std::unique_ptr<void, FreePage>> pages_;
  std::vector<void*> free_;  ///< the slot freed last is at the end: it may still be in the cache
};

constexpr std::size_t kControl_bytes = 128;  ///< at most, of a shared pointer; whole lines of the cache

/// Makes bricks and their colours in pools, which they may outlive.
class FieldBrickMaker {
 public:
  FieldBrickMaker();
  std::shared_ptr<FieldBrick> copy(const FieldBrick& brick) const;  ///< which shares the colour
  std::shared_ptr<FieldBrick> make() const;                         ///< of which nothing is known
  /// `color` null: nothing is observed.
  std::shared_ptr<BrickColor> copy(const BrickColor* color) const;
  std::size_t used_bytes() const;  ///< by all copies, also those that readers hold
  /// Memory of one brick without its colour, and of a colour.
  static constexpr std::size_t kBrick_bytes = sizeof(FieldBrick) + kControl_bytes,
                               kColor_bytes = sizeof(BrickColor) + kControl_bytes;

 private:
  std::shared_ptr<BrickPages> bricks_, colors_;
};

}  // namespace lumigraft::reconstruct

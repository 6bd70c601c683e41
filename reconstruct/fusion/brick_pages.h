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

/// Makes bricks in a pool, which they may outlive.
class FieldBrickMaker {
 public:
  FieldBrickMaker();
  std::shared_ptr<FieldBrick> copy(const FieldBrick& brick) const;
  std::shared_ptr<FieldBrick> make() const;                        ///< of which nothing is known
  std::size_t used_bytes() const { return pages_->used_bytes(); }  ///< by all copies, also those that readers hold

 private:
  std::shared_ptr<BrickPages> pages_;
};

}  // namespace lumigraft::reconstruct

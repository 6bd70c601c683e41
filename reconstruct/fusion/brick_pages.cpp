#include "reconstruct/fusion/brick_pages.h"

#include <sys/mman.h>

#include <new>
#include <utility>

namespace lumigraft::reconstruct {
namespace {

constexpr std::size_t kLine_bytes = 64;  // of the cache
/// A brick and the control block of its shared pointer.
constexpr std::size_t kSlot_bytes = sizeof(FieldBrick) + 2 * kLine_bytes;

/// Allocator of std::allocate_shared. Each copy of it, and so each brick, keeps the pool alive.
template <typename Value>
struct PoolAllocator {
  using value_type = Value;
  std::shared_ptr<BrickPages> pages;

  explicit PoolAllocator(std::shared_ptr<BrickPages> in) : pages(std::move(in)) {}
  template <typename Other>
  PoolAllocator(const PoolAllocator<Other>& other) : pages(other.pages) {}  // NOLINT: implicit by concept

  Value* allocate(std::size_t) {
    static_assert(sizeof(Value) <= kSlot_bytes && alignof(Value) <= kLine_bytes);
    return static_cast<Value*>(pages->allocate());
  }
  void deallocate(Value* slot, std::size_t) { pages->deallocate(slot); }
  template <typename Other>
  bool operator==(const PoolAllocator<Other>& other) const {
    return pages == other.pages;
  }
};

}  // namespace

void* allocate_page() {
  void* page = std::aligned_alloc(kPage_bytes, kPage_bytes);
  if (!page) throw std::bad_alloc();
  ::madvise(page, kPage_bytes, MADV_HUGEPAGE);  // only a hint to the kernel
  return page;
}

BrickPages::BrickPages(std::size_t slot_bytes) : slot_bytes_(slot_bytes) {}

void* BrickPages::allocate() {
  const std::lock_guard lock(mutex_);
  if (free_.empty()) {
    std::byte* page = static_cast<std::byte*>(pages_.emplace_back(allocate_page()).get());
    const std::size_t slots = kPage_bytes / slot_bytes_;
    free_.reserve(pages_.size() * slots);
    for (std::size_t i = slots; i-- > 0;) free_.push_back(page + i * slot_bytes_);
  }
  void* slot = free_.back();
  free_.pop_back();
  return slot;
}

void BrickPages::deallocate(void* slot) {
  const std::lock_guard lock(mutex_);
  free_.push_back(slot);  // reserved, does not allocate
}

std::size_t BrickPages::used_bytes() const {
  const std::lock_guard lock(mutex_);
  return (pages_.size() * (kPage_bytes / slot_bytes_) - free_.size()) * slot_bytes_;
}

FieldBrickMaker::FieldBrickMaker() : pages_(std::make_shared<BrickPages>(kSlot_bytes)) {}

std::shared_ptr<FieldBrick> FieldBrickMaker::copy(const FieldBrick& brick) const {
  return std::allocate_shared<FieldBrick>(PoolAllocator<FieldBrick>(pages_), brick);
}

std::shared_ptr<FieldBrick> FieldBrickMaker::make() const {
  return std::allocate_shared<FieldBrick>(PoolAllocator<FieldBrick>(pages_));
}

}  // namespace lumigraft::reconstruct

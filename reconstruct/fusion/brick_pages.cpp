#include "reconstruct/fusion/brick_pages.h"

#include <sys/mman.h>

#include <new>
#include <utility>

namespace lumigraft::reconstruct {
namespace {

constexpr std::size_t kLine_bytes = 64;  // of the cache

/// Allocator of std::allocate_shared for a pool of `Slot`s. Each copy of it, and so each brick, keeps the pool alive.
template <typename Value, typename Slot = Value>
struct PoolAllocator {
  using value_type = Value;
  std::shared_ptr<BrickPages> pages;

  explicit PoolAllocator(std::shared_ptr<BrickPages> in) : pages(std::move(in)) {}
  template <typename Other>
  PoolAllocator(const PoolAllocator<Other, Slot>& other) : pages(other.pages) {}  // NOLINT: implicit by concept
  template <typename Other>
  struct rebind {
    using other = PoolAllocator<Other, Slot>;
  };

  Value* allocate(std::size_t) {
    static_assert(sizeof(Value) <= sizeof(Slot) + kControl_bytes && alignof(Value) <= kLine_bytes);
    return static_cast<Value*>(pages->allocate());
  }
  void deallocate(Value* slot, std::size_t) { pages->deallocate(slot); }
  template <typename Other>
  bool operator==(const PoolAllocator<Other, Slot>& other) const {
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

FieldBrickMaker::FieldBrickMaker()
    : bricks_(std::make_shared<BrickPages>(kBrick_bytes)), colors_(std::make_shared<BrickPages>(kColor_bytes)) {}

std::shared_ptr<FieldBrick> FieldBrickMaker::copy(const FieldBrick& brick) const {
  return std::allocate_shared<FieldBrick>(PoolAllocator<FieldBrick>(bricks_), brick);
}

std::shared_ptr<FieldBrick> FieldBrickMaker::make() const {
  return std::allocate_shared<FieldBrick>(PoolAllocator<FieldBrick>(bricks_));
}

std::shared_ptr<BrickColor> FieldBrickMaker::copy(const BrickColor* color) const {
  const PoolAllocator<BrickColor> allocator(colors_);
  return color ? std::allocate_shared<BrickColor>(allocator, *color) : std::allocate_shared<BrickColor>(allocator);
}

std::size_t FieldBrickMaker::used_bytes() const { return bricks_->used_bytes() + colors_->used_bytes(); }

}  // namespace lumigraft::reconstruct

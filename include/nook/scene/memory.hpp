#pragma once

#include <cstddef>
#include <new>

#include <nook/scratch.hpp>
#include <nook/target.hpp>

namespace nook {

/// Where a builder gets its memory. Both functions null: from operator new, without exceptions.
struct Memory {
    /// `size` bytes aligned for any scalar, or null when there are none: reported as out_of_memory.
    void* (*allocate)(std::size_t size, void* user) = nullptr;
    /// Takes back a block of `allocate` together with the size that was asked for; never null.
    void (*free)(void* block, std::size_t size, void* user) = nullptr;
    /// Handed to both.
    void* user = nullptr;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET::detail {

/// A block from a Memory, given back at the end of its life.
class Block {
public:
    Block() = default;
    Block(const Memory& memory, std::size_t size) : memory_{memory}, size_{size}
    {
        if (size == 0) return;
        data_ = memory.allocate != nullptr ? memory.allocate(size, memory.user)
                                           : ::operator new(size, std::nothrow);
    }
    Block(Block&& other) noexcept : memory_{other.memory_}, size_{other.size_}, data_{other.data_}
    {
        other.data_ = nullptr;
        other.size_ = 0;
    }
    Block& operator=(Block&& other) noexcept
    {
        if (this == &other) return *this;
        reset();
        memory_ = other.memory_;
        size_ = other.size_;
        data_ = other.data_;
        other.data_ = nullptr;
        other.size_ = 0;
        return *this;
    }
    ~Block() { reset(); }

    void reset()
    {
        if (data_ != nullptr) {
            if (memory_.allocate == nullptr) ::operator delete(data_);
            else if (memory_.free != nullptr) memory_.free(data_, size_, memory_.user);
        }
        data_ = nullptr;
        size_ = 0;
    }
    [[nodiscard]] void* data() const { return data_; }
    [[nodiscard]] std::size_t size() const { return size_; }

private:
    Memory memory_{};
    std::size_t size_ = 0;
    void* data_ = nullptr;
};

/// Allocates a block for the arrays that `layout(arrays)` takes out of a ScratchLayout. Returns how many
/// bytes could not be had: 0 on success.
template <class Layout>
[[nodiscard]] std::size_t allocate_arrays(Block& block, const Memory& memory, const Layout& layout)
{
    ScratchLayout counted;
    layout(counted);
    block = Block{memory, counted.size()};
    if (block.data() == nullptr && counted.size() > 0) return counted.size();
    ScratchLayout arrays{block.data()};
    layout(arrays);
    return 0;
}

}  // namespace nook::inline NOOK_TARGET::detail

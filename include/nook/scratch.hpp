#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <new>
#include <utility>

#include <nook/target.hpp>

namespace nook {

/// Working memory that the caller lends for one call. Kernels never allocate: ask the kernel's
/// `…_scratch_size` how much to lend. Any alignment will do.
struct Scratch {
    void* data = nullptr;
    std::size_t size = 0;

    [[nodiscard]] NOOK_INLINE void* reserve(std::size_t bytes) const
    {
        return bytes <= size ? data : nullptr;
    }
};

/// What kernels take as scratch: `reserve(bytes)` gives that much memory, or null.
template <class S>
concept ScratchSource = requires(S& scratch, std::size_t bytes)
{
    {
        scratch.reserve(bytes)
        } -> std::same_as<void*>;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Scratch from the heap: grows to what the largest call needed and keeps it until destroyed. Keep
/// one beside your buffers, and only the first frame allocates. It is the default of every kernel
/// that needs scratch, so that a call without any is complete; such a call allocates each time.
class HeapScratch {
public:
    HeapScratch() = default;
    HeapScratch(HeapScratch&& other) noexcept
        : data_{std::exchange(other.data_, nullptr)},
          size_{std::exchange(other.size_, 0)}
    {}
    HeapScratch& operator=(HeapScratch&& other) noexcept
    {
        std::swap(data_, other.data_);
        std::swap(size_, other.size_);
        return *this;
    }
    ~HeapScratch() { ::operator delete(data_); }

    [[nodiscard]] void* reserve(std::size_t bytes)
    {
        if (bytes <= size_) return data_;
        ::operator delete(data_);
        data_ = ::operator new(bytes, std::nothrow);
        size_ = data_ != nullptr ? bytes : 0;
        return data_;
    }

private:
    void* data_ = nullptr;
    std::size_t size_ = 0;
};

namespace detail {

/// Cuts arrays out of a block of scratch, each on a cache line of its own. With a null block it
/// only counts, so that one function serves both the size and the layout.
class ScratchLayout {
public:
    static constexpr std::size_t alignment = 64;

    explicit ScratchLayout(void* block = nullptr)
        : base_{static_cast<std::byte*>(block)},
          shift_{block == nullptr
                     ? 0
                     : (alignment - reinterpret_cast<std::uintptr_t>(block) % alignment) %
                           alignment}
    {}

    template <class T>
    T* take(std::size_t count)
    {
        const std::size_t at = used_;
        used_ += (count * sizeof(T) + alignment - 1) / alignment * alignment;
        return base_ == nullptr ? nullptr : reinterpret_cast<T*>(base_ + shift_ + at);
    }
    /// Bytes to ask for, with room to align the block.
    [[nodiscard]] std::size_t size() const { return used_ == 0 ? 0 : used_ + alignment; }

private:
    std::byte* base_;
    std::size_t shift_;
    std::size_t used_ = 0;
};

}  // namespace detail
}  // namespace nook::inline NOOK_TARGET

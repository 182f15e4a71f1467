#pragma once

#include <algorithm>
#include <cstddef>

#include <nook/owned_image.hpp>
#include <nook/scratch.hpp>

namespace report {

/// Scratch of one pass, kept from frame to frame: a nook::HeapScratch that tells how much it holds.
class CountedScratch {
public:
    [[nodiscard]] void* reserve(std::size_t bytes)
    {
        void* const data = scratch_.reserve(bytes);
        bytes_ = data == nullptr ? 0 : (std::max)(bytes_, bytes);
        return data;
    }
    [[nodiscard]] std::size_t bytes() const { return bytes_; }

private:
    nook::HeapScratch scratch_;
    std::size_t bytes_ = 0;
};

static_assert(nook::ScratchSource<CountedScratch>);

/// Bytes of the pixels of an image.
template <class T>
[[nodiscard]] std::size_t bytes_of(const nook::Image<T>& image)
{
    return sizeof(T) * static_cast<std::size_t>(image.end() - image.begin());
}

}  // namespace report

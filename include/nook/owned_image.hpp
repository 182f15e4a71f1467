#pragma once

#include <cstddef>
#include <vector>

#include <nook/image.hpp>

namespace nook::inline NOOK_TARGET {

/// An image that owns its pixels, for programs and tests; kernels only ever see views of it.
/// Allocates through std::vector, and throws as std::vector does.
template <class T>
class Image {
public:
    Image() = default;
    Image(int width, int height, T value = {})
        : width_{width},
          height_{height},
          pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), value)
    {}

    [[nodiscard]] int width() const { return width_; }
    [[nodiscard]] int height() const { return height_; }
    [[nodiscard]] T* data() { return pixels_.data(); }
    [[nodiscard]] const T* data() const { return pixels_.data(); }

    [[nodiscard]] ImageView<T> view() { return {pixels_.data(), width_, height_, width_, 1}; }
    [[nodiscard]] ImageView<const T> view() const
    {
        return {pixels_.data(), width_, height_, width_, 1};
    }
    operator ImageView<T>() { return view(); }
    operator ImageView<const T>() const { return view(); }

    [[nodiscard]] T& operator()(int x, int y) { return view()(x, y); }
    [[nodiscard]] const T& operator()(int x, int y) const { return view()(x, y); }

    [[nodiscard]] auto begin() { return pixels_.begin(); }
    [[nodiscard]] auto end() { return pixels_.end(); }
    [[nodiscard]] auto begin() const { return pixels_.begin(); }
    [[nodiscard]] auto end() const { return pixels_.end(); }

    friend bool operator==(const Image&, const Image&) = default;

private:
    int width_ = 0;
    int height_ = 0;
    std::vector<T> pixels_;
};

}  // namespace nook::inline NOOK_TARGET

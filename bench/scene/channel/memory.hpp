#pragma once

#include <cstddef>
#include <optional>

#include <nook/scene/memory.hpp>

namespace compare {

/// A Memory over the heap that knows how much of it is in use, and how much was at most.
class CountedMemory {
public:
    [[nodiscard]] nook::Memory memory() { return {allocate, free, this}; }
    [[nodiscard]] std::size_t most() const { return most_; }

private:
    static void* allocate(std::size_t size, void* user);
    static void free(void* block, std::size_t size, void* user);

    std::size_t now_ = 0, most_ = 0;
};

/// By how much the memory that this process touches grows at most from here on.
class ResidentGrowth {
public:
    ResidentGrowth();
    /// Nothing where the system does not tell.
    [[nodiscard]] std::optional<std::size_t> most() const;

private:
    std::optional<std::size_t> before_;
};

}  // namespace compare

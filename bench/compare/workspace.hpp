#pragma once

#include <cstddef>

namespace compare {

/// Scratch that grows. All instruction sets share its code.
class Workspace {
public:
    Workspace() = default;
    Workspace(const Workspace&) = delete;
    Workspace& operator=(const Workspace&) = delete;
    ~Workspace();

    [[nodiscard]] void* reserve(std::size_t bytes);
    /// The most that was ever asked for.
    [[nodiscard]] std::size_t size() const { return size_; }

private:
    void* data_ = nullptr;
    std::size_t size_ = 0;
};

}  // namespace compare

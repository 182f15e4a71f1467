#pragma once

#include <memory>

namespace compare {

/// Keeps this thread on the CPU that it runs on, where the system lets it.
class Pinned {
public:
    Pinned();
    ~Pinned();
    Pinned(const Pinned&) = delete;
    Pinned& operator=(const Pinned&) = delete;

private:
    struct Before;
    std::unique_ptr<Before> before_;
};

}  // namespace compare

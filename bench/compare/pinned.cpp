#include "pinned.hpp"

#if defined(__linux__)

#include <sched.h>

namespace compare {

struct Pinned::Before {
    cpu_set_t set;
};

Pinned::Pinned()
{
    auto before = std::make_unique<Before>();
    if (sched_getaffinity(0, sizeof before->set, &before->set) != 0) return;
    const int cpu = sched_getcpu();
    if (cpu < 0 || cpu >= CPU_SETSIZE) return;
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(static_cast<unsigned>(cpu), &one);
    if (sched_setaffinity(0, sizeof one, &one) == 0) before_ = std::move(before);
}

Pinned::~Pinned()
{
    if (before_) sched_setaffinity(0, sizeof before_->set, &before_->set);
}

}  // namespace compare

#else

namespace compare {

struct Pinned::Before {};
Pinned::Pinned() = default;
Pinned::~Pinned() = default;

}  // namespace compare

#endif

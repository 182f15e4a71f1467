#include "memory.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <string>

namespace compare {

namespace {

/// An entry of /proc/self/status in bytes.
std::optional<std::size_t> status(const std::string& name)
{
    std::ifstream file{"/proc/self/status"};
    for (std::string word; file >> word;)
        if (std::size_t kilobytes = 0; word == name && file >> kilobytes) return kilobytes * 1024;
    return {};
}

}  // namespace

void* CountedMemory::allocate(std::size_t size, void* user)
{
    void* const block = std::malloc(size);
    auto& self = *static_cast<CountedMemory*>(user);
    if (block != nullptr) self.most_ = (std::max)(self.most_, self.now_ += size);
    return block;
}

void CountedMemory::free(void* block, std::size_t size, void* user)
{
    static_cast<CountedMemory*>(user)->now_ -= size;
    std::free(block);
}

ResidentGrowth::ResidentGrowth()
{
    // The 5 sets the peak back to what is resident now.
    std::ofstream reset{"/proc/self/clear_refs"};
    if (reset << 5 << std::flush) before_ = status("VmRSS:");
}

std::optional<std::size_t> ResidentGrowth::most() const
{
    const std::optional<std::size_t> peak = status("VmHWM:");
    if (!before_ || !peak) return {};
    return *peak - (std::min)(*peak, *before_);
}

}  // namespace compare

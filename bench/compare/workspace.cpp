#include "workspace.hpp"

#include <new>

namespace compare {

Workspace::~Workspace() { ::operator delete(data_); }

void* Workspace::reserve(std::size_t bytes)
{
    if (bytes <= size_) return data_;
    ::operator delete(data_);
    data_ = ::operator new(bytes, std::nothrow);
    size_ = data_ != nullptr ? bytes : 0;
    return data_;
}

}  // namespace compare

#pragma once

#include <cstddef>
#include <memory>

#include <nook/scene/bvh.hpp>
#include <nook/scene/outline.hpp>
#include <nook/thread_executor.hpp>

#include "../scenes/scene.hpp"

namespace report {

/// Something made once per scene, and what that took.
template <class T>
struct Prepared {
    T value;
    double milliseconds = 0;
    std::size_t bytes = 0;
};

/// What kernels over triangles need beside them; made when first asked for, for all radii.
class Structures {
public:
    explicit Structures(const scenes::Scene& scene, nook::ThreadExecutor& threads)
        : scene_{scene},
          threads_{threads}
    {}

    [[nodiscard]] const scenes::Scene& scene() const { return scene_; }
    [[nodiscard]] const Prepared<nook::Bvh>& hierarchy();
    [[nodiscard]] const Prepared<nook::OutlineShell>& shell();

private:
    const scenes::Scene& scene_;
    nook::ThreadExecutor& threads_;
    std::unique_ptr<Prepared<nook::Bvh>> hierarchy_;
    std::unique_ptr<Prepared<nook::OutlineShell>> shell_;
};

}  // namespace report

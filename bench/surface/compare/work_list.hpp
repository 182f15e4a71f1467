#pragma once

#include <functional>
#include <string>
#include <vector>

#include <nook/owned_image.hpp>

#include "kernels.hpp"
#include "pictures.hpp"

namespace compare {

/// The kernels over depth and normals, and what goes before and after them.
struct Task {
    std::string name;
    int samples = 0;
    bool occlusion = false;  ///< computes visibility itself
    std::function<nook::Outcome(Job job)> run;
};

/// A picture and all buffers that the tasks write. Tasks belong to it.
class WorkList {
public:
    explicit WorkList(const Picture& picture);
    WorkList(const WorkList&) = delete;
    WorkList& operator=(const WorkList&) = delete;

    [[nodiscard]] const std::vector<Task>& tasks() const { return tasks_; }
    /// The places in the list of obscurance with 16 samples and of GTAO.
    static constexpr std::size_t obscurance = 0, horizons = 1;
    /// What a task starts with.
    [[nodiscard]] Job job();

private:
    const Picture& picture_;
    nook::Image<float> noisy_, blurred_, half_, half_blurred_, normals_;
    std::vector<Task> tasks_;
};

}  // namespace compare

#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <nook/owned_image.hpp>

#include "compare/failure.hpp"
#include "compare/rotation.hpp"
#include "compare/table.hpp"
#include "kernels.hpp"
#include "options.hpp"
#include "results.hpp"
#include "views.hpp"

/// What the parts share.
namespace compare {

/// The kernels of the instruction set that was asked for. Throws Failure if there is none.
[[nodiscard]] const Kernels& chosen(const Options& options);

/// A kernel and who plans for it.
struct Planned {
    std::string name;
    int samples = 0;      ///< per pixel, or rays
    bool normals = true;  ///< reads them
    std::function<nook::Outcome(const Job& job)> run;
    /// Empty: nobody.
    std::function<nook::Outcome(const Job& job, const Groups& groups, double tolerance)> plan{};
    /// Takes a tolerance.
    bool tolerant = false;
    /// The same work where it can leave nothing out; empty: `run` without a map leaves nothing out.
    std::function<nook::Outcome(const Job& job)> full{};
};

/// Obscurance with 16 samples, GTAO and bitmasks with 3 slices of 6.
[[nodiscard]] std::vector<Planned> surface_kernels(const Options& options, double radius);
/// Moments in windows of 31 pixels, and by radius.
[[nodiscard]] std::vector<Planned> depth_kernels(const Options& options, const View& rough,
                                                 double radius);

/// What a measurement may add.
struct Extras {
    const char* part = "";
    std::string radius{};  ///< how it is called
    int rounds = 0;        ///< 0: those of the options
    /// Ray-traced visibility of every second pixel of every second row; null: none.
    const nook::Image<float>* traced = nullptr;
};

/// Runs a kernel with all its plans in rotation with itself, and adds it to the results.
const Measurement& measure(const Options& options, const View& view, const Planned& kernel,
                           const Extras& extras, Results& results);

/// How one picture differs from another.
[[nodiscard]] Change change_of(const View& view, const nook::Image<float>& without,
                               const nook::Image<float>& with);

/// Prints measurements from `first` on, a line for each plan.
void print_measurements(const std::string& title, const Results& results, std::size_t first);

/// Draws a plan over the view into the folder of the options, if there is one.
void draw_plan(const Options& options, const View& view, const nook::WorkMap& map,
               const std::string& name);

/// A hierarchy over the triangles of a view, of the instruction set that was asked for.
class Hierarchy {
public:
    Hierarchy(const Options& options, const View& view);
    [[nodiscard]] const void* get() const { return bvh_.get(); }

private:
    std::unique_ptr<void, void (*)(void*)> bvh_;
};

[[nodiscard]] inline Summary per_pixel(const Summary& seconds, std::size_t pixels)
{
    const double scale = 1e9 / double(pixels);
    return {seconds.median * scale, seconds.lower * scale, seconds.upper * scale};
}

}  // namespace compare

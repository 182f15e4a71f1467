#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <nook/image.hpp>
#include <nook/outcome.hpp>
#include <nook/thread_executor.hpp>
#include <nook/work_map.hpp>

#include "structures.hpp"
#include "subject.hpp"
#include "view.hpp"

namespace report {

using Json = nlohmann::ordered_json;

/// What a picture of visibility holds, so that only the like is compared.
enum class Meaning : std::uint8_t {
    visibility,  ///< cosine-weighted share of directions without an occluder in the radius
    obscurance,  ///< the same with 1 − exp(−σ d) for an occluder at distance d
    visibility_secondary,  ///< visibility with two secondary rays per open primary ray
    obscurance_secondary,  ///< obscurance with them
};
[[nodiscard]] const char* name_of(Meaning meaning);

/// What is to be known of a kernel, whatever its settings.
struct KernelInfo {
    const char *name, *family, *what, *source, *needs;
    const char* estimates;  ///< what its values mean, in a line
    /// It estimates what its reference holds. If not, the error after the best monotone fit and the
    /// rank correlation say more than the raw one.
    bool comparable;
};
[[nodiscard]] std::span<const KernelInfo> kernel_infos();

/// A step of a frame. The last one of a kernel writes the visibility; the others write buffers of
/// their own. Keeps its scratch (counted_scratch.hpp): only the first run allocates. The work of all
/// steps is added up, so pixels, background and skipped pixels are for the last one alone to tell.
struct Pass {
    std::string name;
    std::function<nook::Outcome(const nook::ImageView<float>& visibility,
                                nook::ThreadExecutor& threads)>
        run;
};

/// What a step before the last returns: the error, and how often it passed over the image or could
/// do without.
[[nodiscard]] inline nook::Outcome before_last(const nook::Outcome& outcome)
{
    nook::Outcome result;
    result.error = outcome.error;
    result.work.passes = outcome.work.passes;
    result.work.skipped_passes = outcome.work.skipped_passes;
    return result;
}

/// A step that finds out what the next one may leave out.
struct Plan {
    const char* kind = "";  ///< what it looks at: depth, surface, traced, outline
    const char* pass = "";  ///< its name among the passes
    /// By how much it may raise a visibility; 0: no bit changes; none: no bound is known.
    std::optional<double> tolerance = 0;
    /// What it said in the last run.
    std::function<nook::WorkMap()> map;

    [[nodiscard]] bool is_exact() const { return tolerance == 0.0; }
};

/// A kernel with its settings, ready to run on one view.
struct Kernel {
    std::string name;     ///< of a KernelInfo
    std::string id;       ///< with the setting; unique in the cell; letters, digits, dots, dashes
    std::string setting;  ///< in a few words
    Json parameters = Json::object();
    Meaning meaning = Meaning::visibility;
    std::vector<Pass> passes;
    /// The kernel's own formula, pixel by pixel in double, of the rows that the map has; empty when
    /// there is none, or when the kernel is that.
    std::function<nook::Outcome(const nook::ImageView<float>& visibility, const nook::WorkMap& rows,
                                nook::ThreadExecutor& threads)>
        exact;
    /// Samples that `exact` reads per pixel: rows are left out of long ones.
    double exact_samples = 1;
    /// Rows that it computes: one in `row_step`; the others come out as 1 and do not count.
    int row_step = 1;
    bool slow = false;           ///< a reference form: timed once, with all threads
    bool is_default = false;     ///< the settings of the library's defaults
    double preparation = 0;      ///< milliseconds once per scene
    std::size_t structures = 0;  ///< bytes of what the preparation made
    /// Bytes beside inputs, output and structures, after a run: scratch and buffers between passes.
    std::function<std::size_t()> memory;
    /// The id of the kernel that does the same and leaves nothing out, which stands before this one;
    /// empty for none.
    std::string without;
    std::optional<Plan> plan;  ///< of what is left out; kernels that have one name `without`

    [[nodiscard]] bool computes(int y) const { return y % row_step == row_step / 2; }
};

/// What kernels are made for. Outlives them.
struct Setup {
    const Cell& cell;
    const View& view;
    Structures& structures;  ///< of the scene
    bool quick;              ///< fewer settings
    nook::ThreadExecutor& threads;
};

/// A number for a text: three digits at most.
[[nodiscard]] std::string digits(double value);

/// Each adds its family, with all settings; none when the cell is not for it. Kernels over screens want
/// a limited radius, those of the viewpoint channel an unlimited one.
void add_depth_kernels(const Setup& setup, std::vector<Kernel>& kernels);
void add_surface_kernels(const Setup& setup, std::vector<Kernel>& kernels);
void add_outline_kernels(const Setup& setup, std::vector<Kernel>& kernels);
void add_traced_kernels(const Setup& setup, std::vector<Kernel>& kernels);
void add_information_kernels(const Setup& setup, std::vector<Kernel>& kernels);

}  // namespace report

#include "work_list.hpp"

#include <nook/surface/half_resolution.hpp>

#include "common.hpp"

namespace compare {

WorkList::WorkList(const Picture& picture)
    : picture_{picture},
      noisy_{picture.width(), picture.height()},
      blurred_{picture.width(), picture.height()},
      half_{(picture.width() + 1) / 2, (picture.height() + 1) / 2},
      half_blurred_{half_.width(), half_.height()},
      normals_{picture.width(), 3 * picture.height()}
{
    const Kernels& best = targets().best();
    const double radius = picture.radius;
    const auto full = [&, radius](int samples) {
        return [&best, samples, radius](Job job) {
            return best.alchemy_ao(job, {.radius = radius, .samples = samples});
        };
    };
    // The blur of what any kernel left in the first image.
    const auto blur = [this, &best](Job job, bool with_normals) {
        if (!with_normals) job.normals = {};
        job.visibility = blurred_.view();
        return best.bilateral_blur(job, noisy_.view(), {.radius = 4});
    };
    const auto at_half = [this, &best, radius](Job job, bool with_blur) {
        Job small = job;
        small.depth = nook::half_view(job.depth);
        small.normals = nook::half_view(job.normals);
        small.projection = nook::half_projection(job.projection);
        small.visibility = half_.view();
        nook::Outcome outcome = best.alchemy_ao(small, {.radius = radius, .samples = 16});
        if (outcome && with_blur) {
            small.visibility = half_blurred_.view();
            outcome = best.bilateral_blur(small, half_.view(), {.radius = 2});
        }
        if (!outcome) return outcome;
        job.visibility = blurred_.view();
        return best.upsample(job, with_blur ? half_blurred_.view() : half_.view(), {});
    };
    tasks_ = {
        {"AAO 16", 16, true, full(16)},
        {"GTAO, 3 slices x 6", 18, true,
         [&best, radius](Job job) { return best.horizon_ao(job, {.radius = radius}); }},
        {"GTAO, thickness R/4", 18, true,
         [&best, radius](Job job) {
             return best.horizon_ao(job, {.radius = radius, .thickness = radius / 4});
         }},
        {"bitmask, 3 slices x 6", 18, true,
         [&best, radius](Job job) { return best.bitmask_ao(job, {.radius = radius}); }},
        {"AAO 4", 4, true, full(4)},
        {"AAO 8", 8, true, full(8)},
        {"AAO 16, scalable falloff", 16, true,
         [&best, radius](Job job) {
             return best.alchemy_ao(
                 job, {.radius = radius, .samples = 16, .falloff = nook::AlchemyFalloff::scalable});
         }},
        {"blur, radius 4", 0, false, [blur](Job job) { return blur(job, false); }},
        {"blur, radius 4, normals too", 0, false, [blur](Job job) { return blur(job, true); }},
        {"AAO 16 + blur", 16, false,
         [blur, first = full(16)](Job job) {
             const nook::Outcome outcome = first(job);
             return outcome ? blur(job, true) : outcome;
         }},
        {"half size: AAO 16, upsample", 16, false,
         [at_half](Job job) { return at_half(job, false); }},
        {"half size: AAO 16, blur 2, upsample", 16, false,
         [at_half](Job job) { return at_half(job, true); }},
        {"normals from depth", 0, false,
         [this, &best](Job job) {
             const auto plane = [&](int i) {
                 const int width = job.depth.width, height = job.depth.height;
                 return nook::ImageView<float>{&normals_(0, i * height), width, height, width, 1};
             };
             return best.normals_from_depth(job, {plane(0), plane(1), plane(2)});
         }},
    };
}

Job WorkList::job()
{
    Job job = picture_.job();
    job.visibility = noisy_.view();
    return job;
}

}  // namespace compare

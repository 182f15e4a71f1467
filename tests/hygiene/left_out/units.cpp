// One call, compiled once per UNIT, for the compiler's output to be looked at. Scratch is lent, so that
// nothing has to be allocated.
#if defined(UNIT_DEPTH)

#include <nook/depth/chebyshev_ao.hpp>

nook::Outcome shade(const nook::ImageView<const float>& depth,
                    const nook::ImageView<float>& visibility, const nook::ChebyshevOptions& options,
                    const nook::Projection& projection, nook::Scratch scratch)
{
    return nook::chebyshev_ao(depth, visibility, options, projection, {}, scratch);
}

#elif defined(UNIT_SURFACE)

#include <nook/surface/alchemy_ao.hpp>

nook::Outcome shade(const nook::ImageView<const float>& depth, const nook::NormalSource& normals,
                    const nook::ImageView<float>& visibility, const nook::AlchemyOptions& options,
                    const nook::Projection& projection, nook::Scratch scratch)
{
    return nook::alchemy_ao(depth, normals, visibility, options, projection, {}, scratch);
}

#else

#include <nook/scene/traced_ao.hpp>

using nook::Absent;
#if defined(UNIT_FALLOFF)
using Options = nook::TracedOptions<nook::ExponentialFalloff>;
#elif defined(UNIT_SECONDARY)
using Options = nook::TracedOptions<nook::StepFalloff, nook::SecondaryRays>;
#elif defined(UNIT_COLOUR)
using Options =
    nook::TracedOptions<nook::ExponentialFalloff, nook::NoSecondaryRays, nook::FaceAlbedo>;
#else
using Options = nook::TracedOptions<>;
#endif
#if defined(UNIT_BENT)
using Images = nook::TracedImages<float, nook::ImageView3<float>>;
#elif defined(UNIT_COLOUR)
using Images = nook::TracedImages<float, Absent, nook::ImageView3<float>>;
#else
using Images = nook::TracedImages<float>;
#endif

nook::Outcome shade(const nook::Bvh& bvh, const nook::ShadingPoints& points, const Images& images,
                    const Options& options, nook::Scratch scratch)
{
    return nook::traced_ao(bvh, points, images, options, scratch);
}

#endif

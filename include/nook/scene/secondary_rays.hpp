#pragma once

#include <cmath>

#include <nook/target.hpp>

namespace nook {

/// Rays find what they hit. What hides much of the hemisphere and yet is thin as seen from the point,
/// like the lower edge of a curtain, is missed, and the ground beneath it glows.
struct NoSecondaryRays {};

/// Two more rays per open primary ray (Fridvalszky & Tóth 2022, section 4): segments centred on the
/// primary's half way R/2, of half length R′, one perpendicular to the primary and the normal, one
/// perpendicular to both. An open primary counts 1 − closed/2. They need a finite radius; a hit within
/// it counts by the falloff and gets none.
///
/// Where the paper leaves gaps: a segment is cut where it would come closer to the tangent
/// plane of the point than 2⁻¹⁰ of its distance, so that the ground itself hides nothing; a primary along the normal takes a fixed tangent.
/// They help where something lies within √(R²/4 + R′²): a curtain that ends higher keeps its highlight.
struct SecondaryRays {
    /// R′ in world units; negative: half the radius. 0 is the plain result, bit for bit.
    double radius = -1;
    /// Each half of a segment counts by itself: four half rays, an open primary counts 1 − closed/4. The
    /// highlight is then weakened, not removed.
    bool half_rays = false;
    /// 0 … 1: by what share of R/2 the centre wanders along the primary, up or down.
    double jitter = 0;
};

/// A radius R′ that shrinks with the number of primary rays, as the paper suggests: R/2 up to four, then
/// with the distance between neighbouring primaries, N^−1/2. The correction shrinks with it: at R/4
/// (16 rays) part of the highlight is back.
[[nodiscard]] NOOK_INLINE double shrunk_secondary_radius(double radius, int directions)
{
    return directions > 4 ? radius / std::sqrt(static_cast<double>(directions)) : radius / 2;
}

}  // namespace nook

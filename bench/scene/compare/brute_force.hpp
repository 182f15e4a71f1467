#pragma once

#include <cstddef>

#include <nook/target.hpp>

#include "kernels.hpp"

namespace compare::inline NOOK_TARGET {

/// Signed volumes: the ray passes inside a triangle when those that it spans with the three edges have
/// one sign, zero included, and the sum of them is to the volume of the origin and the triangle as
/// the direction is to t.
inline void brute_force(const Soup& soup, const SoupRay* rays, std::size_t count, bool* hits)
{
    constexpr std::size_t lanes = 8, batch = 256;
    for (std::size_t r = 0; r < count; ++r) hits[r] = false;
    // A batch of triangles stays in the cache for all rays.
    for (std::size_t first = 0; first < soup.count; first += batch) {
        const std::size_t last = first + batch < soup.count ? first + batch : soup.count;
        for (std::size_t r = 0; r < count; ++r) {
            if (hits[r]) continue;
            const double ox = rays[r].origin[0], oy = rays[r].origin[1], oz = rays[r].origin[2];
            const double dx = rays[r].direction[0], dy = rays[r].direction[1],
                         dz = rays[r].direction[2], radius = rays[r].radius;
            int any[lanes] = {};
            for (std::size_t base = first; base < last; base += lanes)
                for (std::size_t lane = 0; lane < lanes; ++lane) {
                    const std::size_t i = base + lane;
                    const double ax = soup.corners[0][i] - ox, ay = soup.corners[1][i] - oy,
                                 az = soup.corners[2][i] - oz;
                    const double bx = soup.corners[3][i] - ox, by = soup.corners[4][i] - oy,
                                 bz = soup.corners[5][i] - oz;
                    const double cx = soup.corners[6][i] - ox, cy = soup.corners[7][i] - oy,
                                 cz = soup.corners[8][i] - oz;
                    const double bcx = by * cz - bz * cy, bcy = bz * cx - bx * cz,
                                 bcz = bx * cy - by * cx;
                    const double u = dx * bcx + dy * bcy + dz * bcz;
                    const double v = dx * (cy * az - cz * ay) + dy * (cz * ax - cx * az) +
                                     dz * (cx * ay - cy * ax);
                    const double w = dx * (ay * bz - az * by) + dy * (az * bx - ax * bz) +
                                     dz * (ax * by - ay * bx);
                    const double volume = u + v + w, reach = ax * bcx + ay * bcy + az * bcz;
                    const bool front = (u >= 0) & (v >= 0) & (w >= 0) & (volume > 0) & (reach > 0) &
                                       (reach <= radius * volume);
                    const bool back = (u <= 0) & (v <= 0) & (w <= 0) & (volume < 0) & (reach < 0) &
                                      (reach >= radius * volume);
                    any[lane] |= static_cast<int>(front | back);
                }
            int found = 0;
            for (const int lane : any) found |= lane;
            hits[r] = found != 0;
        }
    }
}

}  // namespace compare::inline NOOK_TARGET

#pragma once

#include <algorithm>
#include <cmath>

#include <nook/scene/vector.hpp>

/// Which way a vertex moves when the faces around it move out: the average of their normals, and the
/// mitre, which moves each of them by the full distance.
namespace nook::inline NOOK_TARGET::detail {

/// The different normals around a vertex. Two within the tolerance count as one, so that it does not
/// matter how a face is cut into triangles.
class NormalSet {
public:
    explicit NormalSet(double tolerance)
        : chord_square_{4 * std::sin(tolerance / 2) * std::sin(tolerance / 2)}
    {}
    void add(const Vector3& normal)
    {
        // Triangles of one face lie side by side: of a great many normals the last will do.
        const int known = count_ < capacity ? count_ : capacity;
        for (int i = 0; i < known; ++i)
            if (same(normals_[i], normal)) return;
        normals_[count_ % capacity] = normal;
        ++count_;
        sum_ = sum_ + normal;
        xx_ += normal.x * normal.x;
        yy_ += normal.y * normal.y;
        zz_ += normal.z * normal.z;
        xy_ += normal.x * normal.y;
        yz_ += normal.y * normal.z;
        zx_ += normal.z * normal.x;
    }
    [[nodiscard]] bool same(const Vector3& a, const Vector3& b) const
    {
        const Vector3 apart = a - b;
        return dot(apart, apart) <= chord_square_;
    }
    [[nodiscard]] Vector3 average() const { return sum_ * (1.0 / count_); }
    /// The x with n · x = 1 for every normal n: of least length where there are many, of least squares
    /// where there is none; 0 where the normals cancel.
    [[nodiscard]] Vector3 mitre() const;

private:
    static constexpr int capacity = 32;

    [[nodiscard]] Vector3 least_squares() const;

    double chord_square_;
    Vector3 normals_[capacity];
    int count_ = 0;
    Vector3 sum_{0, 0, 0};
    double xx_ = 0, yy_ = 0, zz_ = 0, xy_ = 0, yz_ = 0, zx_ = 0;
};

inline Vector3 NormalSet::mitre() const
{
    if (count_ == 1) return normals_[0];
    if (count_ == 2) {
        const double square = 1 + dot(normals_[0], normals_[1]);
        return square > 1e-9 ? sum_ * (1 / square) : Vector3{0, 0, 0};
    }
    if (count_ == 3) {
        const Vector3 &a = normals_[0], &b = normals_[1], &c = normals_[2];
        const double volume = dot(a, cross(b, c));
        if (std::fabs(volume) > 1e-6)
            return (cross(b, c) + cross(c, a) + cross(a, b)) * (1 / volume);
    }
    return least_squares();
}

/// Solves (Σ n nᵀ) x = Σ n: by the adjugate, or where that is nearly singular through the eigenvectors
/// (cyclic Jacobi), leaving out directions that no normal tells anything about.
inline Vector3 NormalSet::least_squares() const
{
    const Vector3 row_x{yy_ * zz_ - yz_ * yz_, yz_ * zx_ - xy_ * zz_, xy_ * yz_ - yy_ * zx_};
    const Vector3 row_y{row_x.y, xx_ * zz_ - zx_ * zx_, xy_ * zx_ - xx_ * yz_};
    const Vector3 row_z{row_x.z, row_y.z, xx_ * yy_ - xy_ * xy_};
    const double determinant = xx_ * row_x.x + xy_ * row_x.y + zx_ * row_x.z;
    const double trace = xx_ + yy_ + zz_;
    if (determinant > 1e-9 * trace * trace * trace)
        return Vector3{dot(row_x, sum_), dot(row_y, sum_), dot(row_z, sum_)} * (1 / determinant);

    double m[3][3] = {{xx_, xy_, zx_}, {xy_, yy_, yz_}, {zx_, yz_, zz_}};
    double v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    constexpr int planes[3][2] = {{0, 1}, {0, 2}, {1, 2}};
    for (int sweep = 0; sweep < 12; ++sweep)
        for (const auto& [p, q] : planes) {
            if (std::fabs(m[p][q]) <= 1e-18 * trace) continue;
            const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
            const double size = std::fabs(theta);
            const double t = (theta < 0 ? -1 : 1) / (size + std::sqrt(theta * theta + 1));
            const double c = 1 / std::sqrt(t * t + 1), s = t * c;
            for (int k = 0; k < 3; ++k) {
                const double kp = m[k][p], kq = m[k][q];
                m[k][p] = c * kp - s * kq;
                m[k][q] = s * kp + c * kq;
            }
            for (int k = 0; k < 3; ++k) {
                const double pk = m[p][k], qk = m[q][k];
                m[p][k] = c * pk - s * qk;
                m[q][k] = s * pk + c * qk;
                const double kp = v[k][p], kq = v[k][q];
                v[k][p] = c * kp - s * kq;
                v[k][q] = s * kp + c * kq;
            }
        }
    Vector3 x{0, 0, 0};
    for (int i = 0; i < 3; ++i) {
        if (!(m[i][i] > 1e-5 * trace)) continue;
        const Vector3 axis{v[0][i], v[1][i], v[2][i]};
        x = x + axis * (dot(axis, sum_) / m[i][i]);
    }
    return x;
}

/// The vector lengthened or shortened until the least n · x over all normals is 1, or 0 where that is not
/// possible. `normal_at(i)`, i < count, are the normals.
template <class NormalAt>
[[nodiscard]] Vector3 reaching(const Vector3& x, int count, const NormalAt& normal_at)
{
    double least = dot(x, normal_at(0));
    for (int i = 1; i < count; ++i) least = (std::min)(least, dot(x, normal_at(i)));
    return least > 1e-6 * largest(x) ? x * (1 / least) : Vector3{0, 0, 0};
}

/// Nearly the shortest vector with n · x >= 1 for all normals, or 0 where they do not fit into a
/// hemisphere: along the centre of the cap that holds them, found by steps towards the normal farthest
/// from it (Badoiu & Clarkson 2003).
template <class NormalAt>
[[nodiscard]] Vector3 shortest_reaching(int count, const NormalAt& normal_at)
{
    Vector3 centre{0, 0, 0};
    for (int i = 0; i < count; ++i) centre = centre + normal_at(i);
    centre = centre * (1.0 / count);
    Vector3 best{0, 0, 0};
    for (int step = 1; step <= 48; ++step) {
        int worst = 0;
        double least = dot(centre, normal_at(0));
        for (int i = 1; i < count; ++i) {
            const double along = dot(centre, normal_at(i));
            if (along < least) {
                least = along;
                worst = i;
            }
        }
        if (least > 1e-6 * largest(centre)) {
            const Vector3 x = centre * (1 / least);
            if (dot(best, best) == 0 || dot(x, x) < dot(best, best)) best = x;
        }
        centre = centre + (normal_at(worst) - centre) * (1.0 / (step + 1));
    }
    return best;
}

}  // namespace nook::inline NOOK_TARGET::detail

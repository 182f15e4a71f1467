#include "even_rings.hpp"

#include <numbers>

#include <glm/geometric.hpp>

namespace scenes {

namespace {

constexpr int curve_points = 256;

}  // namespace

void Section::add(const glm::dvec2& point)
{
    along_.push_back(along_.back() + glm::length(point - points_.back()));
    points_.push_back(point);
}

Section& Section::line(const glm::dvec2& to)
{
    add(to);
    corners_.push_back(along_.back());
    return *this;
}

Section& Section::curve(const glm::dvec2& first, const glm::dvec2& second, const glm::dvec2& to)
{
    const glm::dvec2 from = points_.back();
    for (int i = 1; i <= curve_points; ++i) {
        const double t = double(i) / curve_points, s = 1 - t;
        add(from * (s * s * s) + first * (3 * s * s * t) + second * (3 * s * t * t) +
            to * (t * t * t));
    }
    corners_.push_back(along_.back());
    return *this;
}

Section& Section::arc(const glm::dvec2& middle, double angle)
{
    const glm::dvec2 from = points_.back() - middle;
    for (int i = 1; i <= curve_points; ++i) {
        const double turn = angle * i / curve_points;
        const double cosine = std::cos(turn), sine = std::sin(turn);
        add(middle + glm::dvec2{from.x * cosine - from.y * sine, from.x * sine + from.y * cosine});
    }
    corners_.push_back(along_.back());
    return *this;
}

glm::dvec2 Section::at(double along) const
{
    const auto next = std::upper_bound(along_.begin() + 1, along_.end() - 1, along);
    const auto i = static_cast<std::size_t>(next - along_.begin());
    const double t = (along - along_[i - 1]) / (along_[i] - along_[i - 1]);
    return points_[i - 1] + (points_[i] - points_[i - 1]) * t;
}

std::vector<double> Section::steps(double step) const
{
    std::vector<double> result{0};
    for (std::size_t i = 1; i < corners_.size(); ++i) {
        const double from = corners_[i - 1], extent = corners_[i] - from;
        const int count = (std::max)(1, static_cast<int>(std::lround(extent / step)));
        for (int k = 1; k <= count; ++k)
            result.push_back(k < count ? from + extent * k / count : corners_[i]);
    }
    return result;
}

std::vector<Ring> even_rings(const Section& section, double edge)
{
    std::vector<Ring> rings;
    // As high as triangles of equal sides are.
    for (const double along : section.steps(edge * std::sqrt(0.75))) {
        const double radius = section.at(along).x;
        const double around = 2 * std::numbers::pi * radius / edge;
        const bool pole = radius < 1e-9;
        rings.push_back({along, pole ? 1 : (std::max)(5, static_cast<int>(std::lround(around)))});
    }
    return rings;
}

}  // namespace scenes

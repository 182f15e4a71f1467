#include "document.hpp"

#include <algorithm>
#include <cstddef>
#include <map>
#include <utility>

namespace report {

namespace {

/// A result in the plane of time and error.
struct Point {
    std::size_t result;
    double time, error;
};

/// The results of the points that no other one beats.
std::vector<std::size_t> front_of(std::vector<Point> points)
{
    std::sort(points.begin(), points.end(), [](const Point& a, const Point& b) {
        return a.time != b.time ? a.time < b.time : a.error < b.error;
    });
    std::vector<std::size_t> front;
    const Point* last = nullptr;
    for (const Point& point : points) {
        const bool closer = last == nullptr || point.error < last->error;
        const bool equal =
            last != nullptr && point.error == last->error && point.time == last->time;
        if (!closer && !equal) continue;
        front.push_back(point.result);
        last = &point;
    }
    return front;
}

}  // namespace

void mark_pareto(Json& cell)
{
    Json& results = cell.at("results");
    // Only the like is compared: by meaning and number of threads.
    std::map<std::pair<std::string, int>, std::vector<Point>> planes;
    for (std::size_t i = 0; i < results.size(); ++i) {
        Json& result = results[i];
        result["pareto"] = Json::array();
        if (result.at("slow").get<bool>() || result.at("row_step").get<int>() > 1) continue;
        const double error = result.at("error").at("rmse").get<double>();
        for (const Json& timing : result.at("timings"))
            planes[{result.at("meaning").get<std::string>(), timing.at("threads").get<int>()}]
                .push_back({i, timing.at("median").get<double>(), error});
    }
    // Fewer threads come first in the map, and so in each result.
    for (const auto& [plane, points] : planes)
        for (const std::size_t i : front_of(points)) results[i]["pareto"].push_back(plane.second);
}

}  // namespace report

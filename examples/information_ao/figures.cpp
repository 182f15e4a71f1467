#include <cstddef>
#include <string>
#include <vector>

#include <nook/scene/polygon_values.hpp>

#include "../support/checked.hpp"
#include "pictures.hpp"
#include "results.hpp"

namespace information {

using nook::PolygonState;
using support::Picture;

std::vector<NamedPicture> draw(const CommandLine& command, const Results& results,
                               nook::ThreadExecutor& threads)
{
    const Painter painter{results.scene, command.size.width, command.size.height, threads};
    const auto at_vertices = [&](const std::vector<float>& values,
                                 const std::vector<PolygonState>* seen) {
        // A vertex more, so that there is something to point at.
        std::vector<float> result(results.mesh.vertex_count + 1);
        support::checked(
            nook::polygon_to_vertex_values(results.mesh, values.data(),
                                           seen != nullptr ? seen->data() : nullptr, result.data()),
            "polygon_to_vertex_values");
        return result;
    };
    const Maps& maps = results.maps;
    const std::vector<float> polygon_shade = clipped_shade(maps, command.clip);
    const std::vector<float> shade = at_vertices(polygon_shade, &maps.states);
    const std::vector<float> open = at_vertices(maps.open, &maps.states);
    const std::vector<float> traced = at_vertices(results.traced, nullptr);
    std::vector<NamedPicture> pictures{{"wireframe", painter.wireframe()},
                                       {"pmi-polygons", painter.flat(polygon_shade)},
                                       {"pmi", painter.smooth(shade)},
                                       {"ao", painter.smooth(open)},
                                       {"traced", painter.smooth(traced)}};
    const auto beside = [&](const char* file, std::vector<Picture> row,
                            const std::vector<std::string>& captions) {
        pictures.push_back({file, support::strip(row, captions)});
    };
    beside("information",
           {pictures[0].picture, pictures[1].picture, pictures[2].picture, pictures[3].picture},
           {"wireframe", "PMI of polygons", "PMI, interpolated", "ambient occlusion"});
    beside("comparison", {pictures[2].picture, pictures[3].picture, pictures[4].picture},
           {"PMI", "AO of the pictures", "ray-traced AO"});
    beside("colour", {painter.coloured({}), painter.coloured(shade), painter.coloured(open)},
           {"surface colour", "times PMI", "times ambient occlusion"});
    if (!results.relit.empty()) {
        std::vector<std::vector<float>> colours;
        for (std::size_t k = 0; k < 3; ++k) {
            std::vector<float> one;
            for (std::size_t at = k; at < results.relit.size(); at += 3)
                one.push_back(results.relit[at]);
            colours.push_back(at_vertices(one, &maps.states));
        }
        pictures.push_back({"relit", painter.lit(colours[0], colours[1], colours[2])});
    }
    if (results.important)
        beside("importance",
               {pictures[2].picture,
                painter.smooth(at_vertices(clipped_shade(*results.important, command.clip),
                                           &results.important->states))},
               {"all viewpoints alike", "by importance"});
    return pictures;
}

}  // namespace information

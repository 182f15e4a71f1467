#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include <nook/owned_image.hpp>
#include <nook/scene/rasteriser.hpp>
#include <nook/scene/visible_counts.hpp>
#include <nook/thread_executor.hpp>

#include "meshes.hpp"

namespace {

using meshes::Mesh;
using nook::BackFaces;
using nook::Camera;
using nook::Image;
using nook::Projection;
using nook::ViewFrame;
using Counts = std::vector<std::uint32_t>;

constexpr std::uint32_t untouched = 0x12345678;

struct Counted {
    Counts counts;
    nook::Work work;
};

Counted count(const Mesh& mesh, const ViewFrame& frame, const Projection& projection, int width,
              int height, const nook::VisibleCountOptions& options = {})
{
    Counted result{Counts(mesh.view().triangle_count, untouched), {}};
    const nook::Outcome done = nook::visible_counts(mesh.view(), frame, projection, width, height,
                                                    result.counts.data(), options);
    REQUIRE(done);
    result.work = done.work;
    return result;
}

/// What every pixel shows.
Image<std::uint32_t> faces(const Mesh& mesh, const ViewFrame& frame, const Projection& projection,
                           int width, int height, const nook::RasteriseOptions& options = {})
{
    Image<float> depth{width, height};
    Image<std::uint32_t> face{width, height};
    REQUIRE(
        nook::rasterise(mesh.view(), frame, projection, {depth.view(), {}, face.view()}, options));
    return face;
}

Counts histogram(const Image<std::uint32_t>& faces, std::size_t triangles)
{
    Counts counts(triangles);
    for (const std::uint32_t face : faces)
        if (face != nook::no_face) ++counts[face];
    return counts;
}

std::uint64_t sum(const Counts& counts)
{
    return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
}

/// True for triangles whose corners run clockwise as the viewer sees them, by their planes.
std::vector<bool> seen_from_behind(const Mesh& mesh, const ViewFrame& frame, bool orthographic)
{
    std::vector<bool> result;
    for (std::size_t t = 0; t < mesh.view().triangle_count; ++t) {
        glm::dvec3 p[3];
        for (std::size_t i = 0; i < 3; ++i)
            p[i] = meshes::vertex_position(mesh, mesh.indices[3 * t + i]);
        const glm::dvec3 u = p[1] - p[0], v = p[2] - p[0];
        const glm::dvec3 n{u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
        const glm::dvec3 to = orthographic ? frame.back : frame.origin - p[0];
        result.push_back(n.x * to.x + n.y * to.y + n.z * to.z < 0);
    }
    return result;
}

}  // namespace

TEST_CASE("visible counts are the histogram of the faces that the rasteriser draws")
{
    std::mt19937 random{21};
    std::uniform_real_distribution<double> unit{-1, 1};
    for (int scene = 0; scene < 40; ++scene) {
        CAPTURE(scene);
        const bool orthographic = scene % 3 == 0, inside = scene % 4 == 0;
        const Mesh mesh = scene % 5 == 4 ? meshes::icosphere(4) : meshes::soup(random, 200);
        const Camera camera{.eye = meshes::random_direction(random) * (inside ? 0.4 : 3.0),
                            .target = {0.1 * unit(random), 0.1 * unit(random), 0},
                            .orthographic = orthographic,
                            .vertical_fov = inside ? 1.6 : 0.8,
                            .near_plane = scene % 7 == 0 ? 0.3 : 0,
                            .far_plane = scene % 6 == 1 ? 3.0 : 100.0};
        const int width = 1 + static_cast<int>(random() % 150);
        const int height = 1 + static_cast<int>(random() % 150);
        const ViewFrame frame = nook::view_frame(camera);
        Projection projection = nook::projection(camera, width, height);
        projection.cx += 5.3 * unit(random);
        projection.fy *= 1.2;
        const std::size_t triangles = mesh.view().triangle_count;

        const Image<std::uint32_t> all = faces(mesh, frame, projection, width, height);
        const Counted counted =
            count(mesh, frame, projection, width, height, {.back_faces = BackFaces::counted});
        CHECK(counted.counts == histogram(all, triangles));
        const auto pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
        CHECK(counted.work.pixels == pixels);
        CHECK(counted.work.samples == pixels);
        CHECK(counted.work.background + sum(counted.counts) == pixels);

        const Image<std::uint32_t> front =
            faces(mesh, frame, projection, width, height, {.leave_out_back_faces = true});
        CHECK(count(mesh, frame, projection, width, height, {.back_faces = BackFaces::left_out})
                  .counts == histogram(front, triangles));

        // Occluding: what all pixels show, less the back faces.
        const std::vector<bool> behind = seen_from_behind(mesh, frame, orthographic);
        Counts expected = histogram(all, triangles);
        for (std::size_t t = 0; t < triangles; ++t)
            if (behind[t]) expected[t] = 0;
        const Counted occluding = count(mesh, frame, projection, width, height);
        CHECK(occluding.counts == expected);
        CHECK(occluding.work.background + sum(expected) == pixels);
    }
}

TEST_CASE("a mirrored frame shows the same sides")
{
    std::mt19937 random{22};
    const Mesh mesh = meshes::soup(random, 100);
    const Camera camera{.eye = {0.3, 0.2, 3}};
    const ViewFrame frame = nook::view_frame(camera);
    ViewFrame mirrored = frame;
    mirrored.right = {-frame.right.x, -frame.right.y, -frame.right.z};
    const Projection projection = nook::projection(camera, 90, 70);
    const Image<std::uint32_t> plain =
        faces(mesh, frame, projection, 90, 70, {.leave_out_back_faces = true});
    const Image<std::uint32_t> turned =
        faces(mesh, mirrored, projection, 90, 70, {.leave_out_back_faces = true});
    int different = 0;
    for (int y = 0; y < 70; ++y)
        for (int x = 0; x < 90; ++x) different += plain(x, y) != turned(89 - x, y);
    // Only pixel centres on an edge could go to the other triangle.
    CHECK(different == 0);
    for (const BackFaces back_faces : {BackFaces::left_out, BackFaces::occluding})
        CHECK(count(mesh, frame, projection, 90, 70, {.back_faces = back_faces}).counts ==
              count(mesh, mirrored, projection, 90, 70, {.back_faces = back_faces}).counts);
}

TEST_CASE("for a closed mesh seen from outside, back faces may be left out")
{
    const Mesh ball = meshes::icosphere(4);
    for (const bool orthographic : {false, true}) {
        const Camera camera{.eye = {1, 2, 2}, .orthographic = orthographic};
        const ViewFrame frame = nook::view_frame(camera);
        const Projection projection = nook::projection(camera, 200, 160);
        const Counts all =
            count(ball, frame, projection, 200, 160, {.back_faces = BackFaces::counted}).counts;
        CHECK(sum(all) > 1000);
        CHECK(count(ball, frame, projection, 200, 160).counts == all);
        CHECK(
            count(ball, frame, projection, 200, 160, {.back_faces = BackFaces::left_out}).counts ==
            all);
    }
}

TEST_CASE("a level of l counts like a picture 2^l times as large")
{
    // On pictures this wide a pixel has 2^14 units, one of four times the size 2^12: the same grid.
    std::mt19937 random{23};
    const Mesh mesh = meshes::soup(random, 400);
    const int width = 8192, height = 12;
    for (const bool orthographic : {false, true}) {
        Camera camera{.eye = {0, 0, 3}, .orthographic = orthographic};
        const ViewFrame frame = nook::view_frame(camera);
        Projection projection = nook::projection(camera, width, height);
        projection.fx = orthographic ? 3000 : 9000;
        for (int level = 0; level <= nook::finest_level; ++level) {
            CAPTURE(level);
            const std::vector<std::uint8_t> levels(mesh.view().triangle_count,
                                                   static_cast<std::uint8_t>(level));
            const int scale = 1 << level;
            Projection large = projection;
            for (double* value : {&large.fx, &large.fy, &large.cx, &large.cy}) *value *= scale;
            Counts expected =
                histogram(faces(mesh, frame, large, width * scale, height * scale), levels.size());
            for (std::uint32_t& value : expected) value <<= 2 * (nook::finest_level - level);
            const Counted counted =
                count(mesh, frame, projection, width, height,
                      {.back_faces = BackFaces::counted, .levels = levels.data()});
            CHECK(counted.counts == expected);
            CHECK(sum(expected) > 1000);
            CHECK(counted.work.background + sum(expected) ==
                  std::uint64_t{16} * static_cast<std::uint64_t>(width * height));
        }
    }
}

TEST_CASE("tiles are drawn at the level that their triangles ask for")
{
    // Two squares in the middles of two tiles, far from each other.
    Mesh mesh;
    const auto square = [&](double x, double y, double size) {
        mesh.quad({x, -y, 0}, {x, -(y + size), 0}, {x + size, -(y + size), 0}, {x + size, -y, 0});
    };
    square(10.3, 10.3, 8.25);
    square(74.3, 74.3, 8.25);
    const ViewFrame frame{.origin = {0, 0, 1}};
    const Projection projection{.fx = 1, .fy = 1, .cx = 0, .cy = 0, .orthographic = true};
    const std::vector<std::uint8_t> levels{0, 0, 2, 1};
    const Counted counted = count(mesh, frame, projection, 96, 96, {.levels = levels.data()});
    // 9 × 9 pixel centres lie between 10.3 and 18.55; between 74.3 and 82.55 33 × 33 quarters.
    CHECK(counted.counts[0] + counted.counts[1] == 16 * 9 * 9);
    CHECK(counted.counts[2] + counted.counts[3] == 33 * 33);
    CHECK(counted.work.samples == 8 * 32 * 32 + 16 * 32 * 32);
    CHECK(counted.work.background + sum(counted.counts) == 16 * 96 * 96);
}

TEST_CASE("with mixed levels all samples add up to sixteen for each pixel")
{
    std::mt19937 random{24};
    for (int scene = 0; scene < 12; ++scene) {
        const Mesh mesh = meshes::soup(random, 150);
        std::vector<std::uint8_t> levels(mesh.view().triangle_count);
        // Larger numbers stand for the finest level.
        for (std::uint8_t& level : levels) level = static_cast<std::uint8_t>(random() % 5);
        const Camera camera{.eye = meshes::random_direction(random) * 3.0,
                            .orthographic = scene % 2 == 0};
        const int width = 33 + scene * 11, height = 300 - scene * 17;
        const Counted counted =
            count(mesh, nook::view_frame(camera), nook::projection(camera, width, height), width,
                  height, {.back_faces = BackFaces::counted, .levels = levels.data()});
        CHECK(counted.work.background + sum(counted.counts) ==
              std::uint64_t{16} * static_cast<std::uint64_t>(width * height));
        CHECK(sum(counted.counts) > 0);
    }
}

TEST_CASE("triangles that touch more bins than there is room for are counted all the same")
{
    // Forty thousand, each across the corner of four bins of any size, and some across them all. Every
    // seventh lies within one bin, and many pixels are at one distance with others.
    std::mt19937 random{25};
    std::uniform_real_distribution<double> unit{-1, 1};
    const int width = 1100, height = 600;
    Mesh mesh;
    for (int i = 0; i < 40000; ++i) {
        const double size = i % 1000 == 0 ? 700 : 4, aside = i % 7 == 0 ? 20 : 0;
        const double x = 512 * (1 + i % 2) + aside / 4, y = 512 + aside / 2;
        const double z = -double(random() % 20);
        mesh.triangle({x - size, -(y - size), z}, {x + size * unit(random), -(y + size), z},
                      {x + size, -(y + size * unit(random)), z});
        if (aside > 0) mesh.triangle({x + 3, -y, z}, {x + 1, -y, z}, {x + 3, -y + 2, z});
    }
    const ViewFrame frame{.origin = {0, 0, 1}};
    const Projection projection{.fx = 1, .fy = 1, .cx = 0, .cy = 0, .orthographic = true};
    const Counts expected =
        histogram(faces(mesh, frame, projection, width, height), mesh.view().triangle_count);
    // Parts of the mesh fit.
    Image<float> depth{width, height}, one{width, height};
    Image<std::uint32_t> face{width, height};
    std::fill(depth.begin(), depth.end(), std::numeric_limits<float>::infinity());
    std::fill(face.begin(), face.end(), nook::no_face);
    for (std::size_t first = 0; first < mesh.view().triangle_count; first += 2000) {
        nook::MeshView part = mesh.view();
        part.indices += 3 * first;
        part.triangle_count = (std::min)(std::size_t{2000}, part.triangle_count - first);
        Image<std::uint32_t> faces_of_part{width, height};
        REQUIRE(nook::rasterise(part, frame, projection, {one.view(), {}, faces_of_part.view()}));
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                if (one(x, y) < depth(x, y)) {
                    depth(x, y) = one(x, y);
                    face(x, y) = faces_of_part(x, y) + static_cast<std::uint32_t>(first);
                }
    }
    CHECK(histogram(face, expected.size()) == expected);
    CHECK(
        count(mesh, frame, projection, width, height, {.back_faces = BackFaces::counted}).counts ==
        expected);
}

TEST_CASE("counts do not depend on threads or on whose scratch it is")
{
    std::mt19937 random{26};
    const Mesh mesh = meshes::soup(random, 5000);
    const Camera camera{.eye = {0, 0, 2}};
    const ViewFrame frame = nook::view_frame(camera);
    const Projection projection = nook::projection(camera, 250, 230);
    std::vector<std::uint8_t> levels(mesh.view().triangle_count);
    for (std::size_t t = 0; t < levels.size(); t += 97) levels[t] = 2;
    for (const bool with_levels : {false, true}) {
        const nook::VisibleCountOptions options{.levels = with_levels ? levels.data() : nullptr};
        Counts results[2];
        nook::Work work[2];
        for (const int workers : {1, 4}) {
            nook::ThreadExecutor threads{workers};
            Counts& counts = results[workers == 1 ? 0 : 1];
            counts.assign(mesh.view().triangle_count, untouched);
            std::vector<std::byte> block(
                nook::visible_counts_scratch_size(mesh.view(), 250, 230, workers));
            const nook::Outcome done =
                nook::visible_counts(mesh.view(), frame, projection, 250, 230, counts.data(),
                                     options, nook::Scratch{block.data(), block.size()}, threads);
            REQUIRE(done);
            work[workers == 1 ? 0 : 1] = done.work;
            const Counts before = counts;
            const nook::Outcome cramped = nook::visible_counts(
                mesh.view(), frame, projection, 250, 230, counts.data(), options,
                nook::Scratch{block.data(), block.size() - 1}, threads);
            CHECK(cramped.error.code == nook::ErrorCode::scratch_too_small);
            CHECK(counts == before);
        }
        CHECK(results[0] == results[1]);
        CHECK(work[0].background == work[1].background);
        CHECK(work[0].samples == work[1].samples);
    }
}

TEST_CASE(
    "scratch for counts is at most 16 bytes per triangle of a closed mesh and half a megabyte")
{
    const nook::MeshView mesh{.vertex_count = 500002, .triangle_count = 1000000};
    CHECK(nook::visible_counts_scratch_size(mesh, 512, 512, 1) <= 16 * 1000000 + (1 << 19));
}

TEST_CASE("no mesh, no pixels and vertices that are no numbers count nothing")
{
    const ViewFrame frame = nook::view_frame({});
    const Projection projection = nook::projection({}, 5, 4);
    const nook::Outcome none = nook::visible_counts({}, frame, projection, 5, 4, nullptr);
    REQUIRE(none);
    CHECK(none.work.background == 20);
    Mesh mesh = meshes::icosphere(0);
    CHECK(sum(count(mesh, frame, projection, 0, 0).counts) == 0);
    CHECK(sum(count(mesh, frame, projection, 0, 4).counts) == 0);
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
          -std::numeric_limits<float>::infinity()})
        for (std::size_t k = 0; k < 3; ++k) {
            Mesh broken = mesh;
            broken.positions[k] = bad;
            const Counts counts =
                count(broken, frame, projection, 5, 4, {.back_faces = BackFaces::counted}).counts;
            for (std::size_t t = 0; t < counts.size(); ++t)
                if (broken.indices[3 * t] == 0 || broken.indices[3 * t + 1] == 0 ||
                    broken.indices[3 * t + 2] == 0)
                    CHECK(counts[t] == 0);
        }
}

TEST_CASE("arguments that counts cannot work with are named, and nothing is written")
{
    Mesh mesh = meshes::icosphere(0);
    const ViewFrame frame = nook::view_frame({});
    const Projection projection = nook::projection({}, 5, 4);
    Counts counts(20, untouched);
    const auto rejected = [&](const nook::Outcome& outcome) {
        CHECK(counts == Counts(20, untouched));
        return std::string{outcome.error.argument};
    };
    std::uint32_t* const out = counts.data();
    CHECK(rejected(nook::visible_counts(mesh.view(), frame, projection, -1, 4, out)) == "width");
    CHECK(rejected(nook::visible_counts(mesh.view(), frame, projection, 5, 32769, out)) ==
          "height");
    CHECK(rejected(nook::visible_counts(mesh.view(), frame, projection, 5, 4, nullptr)) ==
          "counts");
    const std::vector<std::uint8_t> levels(20);
    CHECK(rejected(nook::visible_counts(mesh.view(), frame, projection, 32768, 8192, out,
                                        {.levels = levels.data()})) == "width");
    Projection bad = projection;
    bad.fx = 0;
    CHECK(rejected(nook::visible_counts(mesh.view(), frame, bad, 5, 4, out)) == "projection.fx");
    ViewFrame bent = frame;
    bent.up.x = std::numeric_limits<double>::quiet_NaN();
    CHECK(rejected(nook::visible_counts(mesh.view(), bent, projection, 5, 4, out)) == "frame.up");
    CHECK(rejected(nook::visible_counts(mesh.view(), frame, projection, 5, 4, out,
                                        {.near_plane = -1})) == "options.near_plane");
    mesh.indices[7] = 99;
    CHECK(rejected(nook::visible_counts(mesh.view(), frame, projection, 5, 4, out)) ==
          "mesh.indices");
}

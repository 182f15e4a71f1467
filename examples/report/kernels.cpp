#include "kernels.hpp"

#include <cstdio>

namespace report {

namespace {

constexpr const char* chan = "H. Chan & S. Im, Chebyshev Ambient Occlusion, 2021";
constexpr const char* alchemy =
    "M. McGuire, B. Osman, M. Bukowski & P. Hennessy, The Alchemy Screen-Space Ambient Obscurance "
    "Algorithm, 2011";
constexpr const char* scalable =
    "M. McGuire, M. Mara & D. Luebke, Scalable Ambient Obscurance, 2012";
constexpr const char* gtao =
    "J. Jimenez, X. Wu, A. Pesce & A. Jarabo, Practical Real-Time Strategies for Accurate Indirect "
    "Occlusion, 2016";
constexpr const char* bitmask =
    "O. Therrien, Y. Levesque & G. Gilet, Screen Space Indirect Lighting with Visibility Bitmask, "
    "2023";
constexpr const char* outlines =
    "Park & Baek, A Corner-Highlighting Method for Ambient Occlusion, 2021";
constexpr const char* secondary =
    "Fridvalszky & Tóth, Accounting for Non-Uniform Ambient Lighting in Ray Traced Ambient "
    "Occlusion, 2022";
constexpr const char* viewpoints =
    "González, Sbert & Feixas, An Information-Theoretic Ambient Occlusion, 2008";

constexpr const char* zhukov =
    "S. Zhukov, A. Iones & G. Kronin, An Ambient Light Illumination Model, 1998";
constexpr const char* zhukov_step =
    "S. Zhukov, A. Iones & G. Kronin, An Ambient Light Illumination Model, 1998, with a step for "
    "its falloff";

constexpr const char* bound =
    "Cantelli's upper bound on the share of a window that lies at or behind the pixel";
constexpr const char* dimmed_bound =
    "that bound, with less shade the farther the mean of the window lies in front of the pixel";
constexpr const char* obscurance =
    "obscurance by a formula of its own: its intensity is a setting, not geometry";
constexpr const char* slices =
    "cosine-weighted visibility of the depth buffer as a height field, within the radius";
constexpr const char* thick_slices =
    "cosine-weighted visibility within the radius of a depth buffer whose surfaces are half the "
    "radius thick";

constexpr const char* share = "cosine-weighted visibility within the radius";
constexpr const char* share_secondary =
    "cosine-weighted visibility in which an open ray counts less where secondary rays are closed";
constexpr const char* faded = "cosine-weighted obscurance, exponential falloff";
constexpr const char* faded_secondary =
    "cosine-weighted obscurance in which an open ray counts less where secondary rays are closed";

constexpr KernelInfo infos[] = {
    {"chebyshev-window", "depth", "Chebyshev AO, the same window for all pixels", chan, "depth",
     bound, false},
    {"chebyshev-radius", "depth",
     "Chebyshev AO, windows that span a world radius at each pixel's distance", chan, "depth",
     bound, false},
    {"chebyshev-range", "depth", "Chebyshev AO, the same window for all pixels, range check", chan,
     "depth", dimmed_bound, false},
    {"chebyshev-range-exact", "depth",
     "Chebyshev AO, each sample checked for range, and only together with its mirror image; all "
     "samples of each window are read",
     chan, "depth",
     "Cantelli's upper bound on the share of the pairs of samples within range that lies at or "
     "behind the pixel",
     false},

    {"alchemy", "surface", "Alchemy AO: samples of a disc on the screen, weight 1 / distance",
     alchemy, "depth, normals", obscurance, false},
    {"alchemy-blurred", "surface", "Alchemy AO, then a blur that keeps to surfaces", alchemy,
     "depth, normals", obscurance, false},
    {"alchemy-half", "surface",
     "Alchemy AO at every second pixel of every second row, brought back along surfaces",
     "The Alchemy algorithm (McGuire et al. 2011), with J. Kopf et al., Joint Bilateral "
     "Upsampling, 2007",
     "depth, normals", obscurance, false},
    {"alchemy-planned", "surface", "Alchemy AO, where something may rise above the surface",
     alchemy, "depth, normals", obscurance, false},
    {"alchemy-tolerant", "surface",
     "Alchemy AO, where what rises may darken a pixel by more than a tolerance", alchemy,
     "depth, normals", obscurance, false},
    {"scalable", "surface", "Scalable ambient obscurance: as Alchemy, weight 0 from the radius on",
     scalable, "depth, normals", obscurance, false},
    {"scalable-blurred", "surface",
     "Scalable ambient obscurance, then a blur that keeps to surfaces", scalable, "depth, normals",
     obscurance, false},
    {"scalable-planned", "surface",
     "Scalable ambient obscurance, where something may rise above the surface", scalable,
     "depth, normals", obscurance, false},
    {"scalable-tolerant", "surface",
     "Scalable ambient obscurance, where what rises may darken a pixel by more than a tolerance",
     scalable, "depth, normals", obscurance, false},
    {"horizon", "surface", "GTAO: the highest samples on both sides of slices through the pixel",
     gtao, "depth, normals", slices, true},
    {"horizon-blurred", "surface", "GTAO, then a blur that keeps to surfaces", gtao,
     "depth, normals", slices, true},
    {"horizon-planned", "surface", "GTAO, where something may rise above the surface", gtao,
     "depth, normals", slices, true},
    {"horizon-tolerant", "surface",
     "GTAO, where what rises may darken a pixel by more than a tolerance", gtao, "depth, normals",
     slices, true},
    {"bitmask", "surface", "Visibility bitmask: slices whose samples have a thickness", bitmask,
     "depth, normals", thick_slices, true},
    {"bitmask-blurred", "surface", "Visibility bitmask, then a blur that keeps to surfaces",
     bitmask, "depth, normals", thick_slices, true},
    {"bitmask-planned", "surface", "Visibility bitmask, where something may rise above the surface",
     bitmask, "depth, normals", thick_slices, true},
    {"bitmask-tolerant", "surface",
     "Visibility bitmask, where what rises may darken a pixel by more than a tolerance", bitmask,
     "depth, normals", thick_slices, true},

    {"masked", "outline", "Alchemy AO where the outlines of objects overlap, 1 elsewhere", outlines,
     "depth, normals, triangles", "obscurance as alchemy; 1 where only one object is near", false},
    {"stand-alone", "outline", "The blurred stencil of overlapping outlines", outlines,
     "depth, triangles", "how much of the screen around the pixel lies near another object", false},

    {"traced", "traced", "Rays in cosine-weighted directions, open or not within the radius",
     zhukov_step, "depth, normals, triangles", share, true},
    {"traced-secondary", "traced",
     "The same, and two secondary rays across each open one find what it passed", secondary,
     "depth, normals, triangles", share_secondary, true},
    {"traced-obscurance", "traced",
     "Rays in cosine-weighted directions; one that is closed at distance d counts 1 - exp(-sigma "
     "d)",
     zhukov, "depth, normals, triangles", faded, true},
    {"traced-obscurance-secondary", "traced",
     "The same, and two secondary rays across each open one find what it passed", secondary,
     "depth, normals, triangles", faded_secondary, true},
    {"traced-planned", "traced", "Rays as traced, where triangles rise above the surface",
     zhukov_step, "depth, normals, triangles", share, true},
    {"traced-secondary-planned", "traced",
     "Rays as traced-secondary, where triangles are in reach of them", secondary,
     "depth, normals, triangles", share_secondary, true},

    {"information-visibility", "information",
     "Visible over open area of each polygon, summed over the pictures from all around", viewpoints,
     "triangles", "cosine-weighted visibility of each polygon, unlimited radius", true},
    {"information-pmi", "information",
     "Mutual information of each polygon with the viewpoints, turned and normalised", viewpoints,
     "triangles", "how evenly the viewpoints see a polygon: no visibility", false},
};

}  // namespace

const char* name_of(Meaning meaning)
{
    switch (meaning) {
    case Meaning::visibility: return "visibility";
    case Meaning::obscurance: return "obscurance";
    case Meaning::visibility_secondary: return "visibility-secondary";
    case Meaning::obscurance_secondary: return "obscurance-secondary";
    }
    return "";
}

std::span<const KernelInfo> kernel_infos() { return infos; }

std::string digits(double value)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.3g", value);
    return text;
}

}  // namespace report

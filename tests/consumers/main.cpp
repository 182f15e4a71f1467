// What a program of somebody else's looks like: its own flags, its own names, nook from outside.
#include <cstdio>

#include <nook/nook.hpp>

int main()
{
    const float depth[] = {1, 1, 1, 1, 2, 1, 1, 1, 1};
    float visibility[9] = {};
    const nook::Outcome done =
        nook::chebyshev_ao(nook::ImageView<const float>{depth, 3, 3},
                           nook::ImageView<float>{visibility, 3, 3}, {.window = 3, .bias = 0});
    const nook::Camera camera{};
    const glm::dvec3 axis = nook::view_frame(camera).back;
    std::printf("nook %s: %g\n", nook::version, double{visibility[4]});
    // The one pixel of nine that lies behind the others: Cantelli's bound is an equality, 1/9.
    return done && axis.z == 1 && visibility[4] > 0.11f && visibility[4] < 0.112f ? 0 : 1;
}

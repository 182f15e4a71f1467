// A depth buffer goes in, ambient occlusion comes out. Needs the ground floor and depth/ alone.
#include <cstdio>
#include <vector>

#include <nook/depth/chebyshev_ao.hpp>

#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb/stb_image_write.h>

int main(int argc, char** argv)
{
    const char* path = argc > 1 ? argv[1] : "drop_in.png";
    constexpr int width = 320, height = 240;

    // A renderer's depth buffer: a round pit in a wall ten units away.
    std::vector<float> z(width * height), out(width * height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const int dx = x - width / 2, dy = y - height / 2;
            z[size_t(y * width + x)] = dx * dx + dy * dy < 60 * 60 ? 11.0f : 10.0f;
        }

    // [snippet]
    nook::ImageView<const float> depth{z.data(), width, height};
    nook::ImageView<float> visibility{out.data(), width, height};
    if (auto done = nook::chebyshev_ao(depth, visibility, {.window = 31}); !done) {
        char text[160];
        nook::describe(done.error, text, sizeof text);
        std::fprintf(stderr, "%s\n", text);
        return 1;
    }
    std::printf("middle %.2f, edge of the pit %.2f\n", visibility(160, 120), visibility(218, 120));
    // [snippet]

    std::vector<unsigned char> grey;
    for (const float value : out) grey.push_back(static_cast<unsigned char>(255 * value + 0.5f));
    return stbi_write_png(path, width, height, 1, grey.data(), width) == 0;
}

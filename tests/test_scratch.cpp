#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include <nook/scratch.hpp>

#if defined(__SANITIZE_ADDRESS__)
#define SANITIZED
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define SANITIZED
#endif
#endif

TEST_SUITE("scratch")
{
    TEST_CASE("lent memory serves up to its size")
    {
        std::byte block[16];
        const nook::Scratch scratch{block, sizeof block};
        CHECK(scratch.reserve(0) == block);
        CHECK(scratch.reserve(16) == block);
        CHECK(scratch.reserve(17) == nullptr);
        CHECK(nook::Scratch{}.reserve(1) == nullptr);
        CHECK(nook::ScratchSource<const nook::Scratch>);
        CHECK(nook::ScratchSource<nook::HeapScratch>);
        CHECK_FALSE(nook::ScratchSource<int>);
    }

    TEST_CASE("heap scratch grows to the largest call and then stays")
    {
        nook::HeapScratch scratch;
        void* first = scratch.reserve(100);
        REQUIRE(first != nullptr);
        std::memset(first, 1, 100);
        CHECK(scratch.reserve(50) == first);
        CHECK(scratch.reserve(100) == first);
        void* second = scratch.reserve(1 << 20);
        REQUIRE(second != nullptr);
        std::memset(second, 2, 1 << 20);
        CHECK(scratch.reserve(1 << 20) == second);
        CHECK(scratch.reserve(1) == second);
    }

    TEST_CASE("heap scratch that cannot be had is null, and the next call may succeed")
    {
        nook::HeapScratch scratch;
        REQUIRE(scratch.reserve(10) != nullptr);
// AddressSanitizer ends the program at an absurd size.
#if !defined(SANITIZED)
        CHECK(scratch.reserve(SIZE_MAX / 2) == nullptr);
#endif
        CHECK(scratch.reserve(10) != nullptr);
    }

    TEST_CASE("heap scratch moves")
    {
        nook::HeapScratch scratch;
        void* block = scratch.reserve(10);
        nook::HeapScratch moved{std::move(scratch)};
        CHECK(moved.reserve(10) == block);
        nook::HeapScratch other;
        (void)other.reserve(1000);
        other = std::move(moved);
        CHECK(other.reserve(10) == block);
    }

    TEST_CASE("arrays of a layout are aligned, apart and inside, wherever the block begins")
    {
        using nook::detail::ScratchLayout;
        ScratchLayout count;
        CHECK(count.size() == 0);
        CHECK(count.take<double>(3) == nullptr);
        CHECK(count.take<char>(65) == nullptr);
        CHECK(count.take<float>(16) == nullptr);
        CHECK(count.take<int>(0) == nullptr);
        const std::size_t size = count.size();
        CHECK(size == 64 + 128 + 64 + 64);

        std::vector<unsigned char> memory(size + 128, 0);
        for (std::size_t offset = 0; offset < 64; ++offset) {
            unsigned char* block = memory.data() + offset;
            ScratchLayout layout{block};
            double* a = layout.take<double>(3);
            char* b = layout.take<char>(65);
            float* c = layout.take<float>(16);
            CHECK(layout.size() == size);
            for (void* array :
                 {static_cast<void*>(a), static_cast<void*>(b), static_cast<void*>(c)})
                CHECK(reinterpret_cast<std::uintptr_t>(array) % 64 == 0);
            CHECK(reinterpret_cast<unsigned char*>(a) >= block);
            CHECK(static_cast<void*>(a + 3) <= static_cast<void*>(b));
            CHECK(static_cast<void*>(b + 65) <= static_cast<void*>(c));
            CHECK(reinterpret_cast<unsigned char*>(c + 16) <= block + size);
        }
    }
}

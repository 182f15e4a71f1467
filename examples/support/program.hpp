#pragma once

#include <cstdio>
#include <exception>
#include <new>
#include <string>

namespace support {

/// The frame of a main(): 0 when `body` returns; 2, with one line on stderr that begins with the name of
/// the program, when it throws.
template <class Body>
int run_program(const char* name, const Body& body)
{
    const auto fail = [&](std::string why) {
        for (char& c : why)
            if (c == '\n' || c == '\r') c = ' ';
        std::fprintf(stderr, "%s: %s\n", name, why.c_str());
        return 2;
    };
    try {
        body();
        return 0;
    } catch (const std::bad_alloc&) {
        return fail("out of memory");
    } catch (const std::exception& error) {
        return fail(error.what());
    }
}

}  // namespace support

# What a call does not ask for is not in the program: options that types choose compile away, and no
# kernel brings exceptions, allocation, threads, locales or state of its own. Read off the symbols and
# sizes of optimised objects, whose sizes are compared with each other alone.
include(${CMAKE_CURRENT_LIST_DIR}/common.cmake)

find_program(NM NAMES nm llvm-nm REQUIRED)
find_program(SIZE NAMES size llvm-size REQUIRED)

# PLAIN traces visibility with TracedOptions<>; those after it ask for more.
set(units DEPTH SURFACE PLAIN SECONDARY BENT FALLOFF COLOUR)
foreach(unit IN LISTS units)
    # Without -fno-pic tables of constants with pointers would count as writable.
    start_command(${COMPILER} ${strict_flags} -O2 -fno-pic -DUNIT_${unit}
        -c ${CMAKE_CURRENT_LIST_DIR}/left_out/units.cpp -o ${WORK_DIR}/${unit}.o)
endforeach()
finish_commands()

# The functions of the C library that take long, by unit. Only these may call any.
set(slow "exp|exp2|exp10|expm1|log|log2|log10|log1p|pow|sin|cos|sincos|tan|asin|acos|atan|atan2|sinh")
string(APPEND slow "|cosh|tanh|asinh|acosh|atanh|cbrt|hypot|erf|erfc|tgamma|lgamma|fmod|remainder")
set(slow_SURFACE "pow|sin|cos|sincos")  # the contrast, and the offsets of the samples
set(slow_FALLOFF "expm1")
set(slow_COLOUR "expm1")
# Of the run-time libraries. Mangled names are those of C++: operator new, std::… and the like.
set(unwanted "_?_Z.+|_*cxa_.+|_*Unwind_.+|pthread_.+|thrd_.+|_*tls_.+|_*emutls_.+|malloc|calloc")
string(APPEND unwanted "|realloc|free|aligned_alloc|posix_memalign|abort|_*exit|_*assert_.+")
string(APPEND unwanted "|_*(f|v|s|sn)*printf(_chk)?|puts|putchar|f(open|write|puts)|getenv|setlocale")

foreach(unit IN LISTS units)
    execute_process(COMMAND ${NM} -u ${WORK_DIR}/${unit}.o
        OUTPUT_VARIABLE undefined_${unit} COMMAND_ERROR_IS_FATAL ANY)
    string(REGEX MATCHALL "[^ \n]+\n" undefined "${undefined_${unit}}")
    list(TRANSFORM undefined STRIP)
    foreach(symbol IN LISTS undefined)
        if(symbol MATCHES "^(${unwanted})$")
            message(SEND_ERROR "${unit} needs ${symbol}")
        elseif(symbol MATCHES "^_*(${slow})[fl]?$" AND
               NOT (slow_${unit} AND symbol MATCHES "^_*(${slow_${unit}})[fl]?$"))
            message(SEND_ERROR "${unit} calls ${symbol}")
        endif()
    endforeach()

    execute_process(COMMAND ${NM} -C --defined-only ${WORK_DIR}/${unit}.o
        OUTPUT_VARIABLE symbols_${unit} COMMAND_ERROR_IS_FATAL ANY)
    if(NOT symbols_${unit} MATCHES " shade\\(")
        message(SEND_ERROR "${unit}: nm does not show the function of the unit")
    endif()
    if(unit MATCHES "DEPTH|SURFACE" AND symbols_${unit} MATCHES "glm::")
        message(SEND_ERROR "${unit} has code of GLM")
    endif()

    execute_process(COMMAND ${SIZE} ${WORK_DIR}/${unit}.o
        OUTPUT_VARIABLE sizes COMMAND_ERROR_IS_FATAL ANY)
    if(NOT sizes MATCHES "\n[ \t]*([0-9]+)[ \t]+([0-9]+)[ \t]+([0-9]+)")
        message(FATAL_ERROR "sizes of text, data and bss are not in\n  ${sizes}")
    endif()
    set(text_${unit} ${CMAKE_MATCH_1})
    # Variables with static storage, their guards, and what initialises them before main.
    if(NOT CMAKE_MATCH_2 EQUAL 0 OR NOT CMAKE_MATCH_3 EQUAL 0)
        message(SEND_ERROR "${unit} keeps state: ${CMAKE_MATCH_2} bytes of data, "
            "${CMAKE_MATCH_3} of zeros")
    endif()
endforeach()

# The first asks for one thing more than the second, which makes its code longer by some percent: what
# the option takes would otherwise be in both. (With a falloff or colour rays look for the nearest hit
# instead of any: that is other code, not more.)
foreach(triple "SECONDARY;PLAIN;10" "BENT;PLAIN;1" "COLOUR;FALLOFF;1")
    list(GET triple 0 more)
    list(GET triple 1 less)
    list(GET triple 2 percent)
    math(EXPR least "${text_${less}} * (100 + ${percent}) / 100")
    if(text_${more} LESS least)
        message(SEND_ERROR "${more} has ${text_${more}} bytes of code, and ${less}, which asks for less, "
            "${text_${less}}: no ${percent} percent between them")
    endif()
endforeach()

# What is asked for shows: otherwise the check of its absence could not fail.
foreach(pair "FALLOFF;Nearest" "COLOUR;Nearest" "SECONDARY;trace_secondary")
    list(GET pair 0 asking)
    list(GET pair 1 name)
    if(NOT symbols_${asking} MATCHES "${name}")
        message(SEND_ERROR "${asking}: no symbol holds the name ${name}; what is it called now?")
    endif()
    foreach(unit PLAIN BENT)
        if(symbols_${unit} MATCHES "${name}")
            message(SEND_ERROR "${unit} has code that ${asking} alone asks for: ${name}")
        endif()
    endforeach()
endforeach()
if(NOT undefined_FALLOFF MATCHES "expm1")
    message(SEND_ERROR "FALLOFF: no call of expm1; what does it call now?")
endif()

# What a header costs whoever includes it, in preprocessed lines that are not blank: its own and those
# of the headers of nook behind it, and with them those of other libraries. weight.txt holds a limit
# for each header; what exceeds it has to be wanted. To write the limits anew:
#   cmake -DUPDATE=ON -DSOURCE_DIR=. -DWORK_DIR=build/weight -DCOMPILER=g++
#       -P tests/hygiene/weight.cmake
# Limits that still fit stay as they are. The others get a margin: a tenth and 20 lines of nook, a
# twentieth and 100 lines in all.
cmake_path(ABSOLUTE_PATH SOURCE_DIR)
cmake_path(ABSOLUTE_PATH WORK_DIR)
include(${CMAKE_CURRENT_LIST_DIR}/common.cmake)
set(table ${CMAKE_CURRENT_LIST_DIR}/weight.txt)

# An empty stand-in for each header of others leaves the lines of nook alone, and tells which of them
# are reached.
foreach(header IN LISTS headers)
    file(STRINGS ${SOURCE_DIR}/include/${header} lines REGEX "^ *# *include")
    foreach(line IN LISTS lines)
        if(NOT line MATCHES "<nook/" AND line MATCHES "<(.+)>")
            file(WRITE ${WORK_DIR}/empty/${CMAKE_MATCH_1} "")
        endif()
    endforeach()
endforeach()

# Lines that are not blank: each becomes one letter.
function(count_lines file result)
    file(READ ${file} text)
    string(REGEX REPLACE "[ \t\n]*[^ \t\n][^\n]*" "x" text "${text}")
    string(REGEX REPLACE "[^x]" "" text "${text}")
    string(LENGTH "${text}" count)
    set(${result} ${count} PARENT_SCOPE)
endfunction()

foreach(header IN LISTS headers)
    string(MAKE_C_IDENTIFIER ${header} name)
    start_command(${COMPILER} -std=c++20 -E -P -nostdinc -nostdinc++ -I${WORK_DIR}/empty
        -I${SOURCE_DIR}/include -MD -MF ${WORK_DIR}/${name}.d -include ${header}
        -x c++ /dev/null -o ${WORK_DIR}/${name}.own)
endforeach()
finish_commands()

# The others weigh the same wherever the same of them are reached.
set(sets)
foreach(header IN LISTS headers)
    string(MAKE_C_IDENTIFIER ${header} name)
    count_lines(${WORK_DIR}/${name}.own own_${header})
    file(READ ${WORK_DIR}/${name}.d rule)
    string(REGEX MATCHALL "/empty/[^ \\\n]+" others "${rule}")
    list(SORT others)
    string(MD5 set_${header} "${others}")
    list(TRANSFORM others REPLACE "/empty/" "-include;")
    if(NOT set_${header} IN_LIST sets)
        list(APPEND sets ${set_${header}})
        start_command(${COMPILER} ${strict_flags} -E -P ${others} -x c++ /dev/null
            -o ${WORK_DIR}/${set_${header}})
    endif()
endforeach()
finish_commands()
foreach(set IN LISTS sets)
    count_lines(${WORK_DIR}/${set} lines_${set})
endforeach()
foreach(header IN LISTS headers)
    math(EXPR all_${header} "${own_${header}} + ${lines_${set_${header}}}")
endforeach()
if(NOT own_nook/nook.hpp GREATER 10000 OR NOT all_nook/nook.hpp GREATER 50000)
    message(FATAL_ERROR "nook/nook.hpp cannot have ${own_nook/nook.hpp} lines of nook and "
        "${all_nook/nook.hpp} in all")
endif()

# Other libraries weigh as much as in the table in the versions of Debian 12 alone.
execute_process(COMMAND ${COMPILER} ${strict_flags} -dM -E -include version -include glm/vec3.hpp
    -x c++ /dev/null OUTPUT_VARIABLE macros COMMAND_ERROR_IS_FATAL ANY)
set(columns own)
if(macros MATCHES "define _GLIBCXX_RELEASE 12\n" AND macros MATCHES "define GLM_VERSION 998\n")
    list(APPEND columns all)
else()
    message(STATUS "other libraries than libstdc++ 12 and GLM 0.9.9.8: lines in all not compared")
endif()

set(listed)
set(rows)
if(EXISTS ${table})
    file(STRINGS ${table} rows REGEX "^[^#]")
endif()
foreach(row IN LISTS rows)
    if(NOT row MATCHES "^([^ ]+) +([0-9]+) +([0-9]+)$")
        message(FATAL_ERROR "weight.txt: not a header and two numbers: ${row}")
    endif()
    list(APPEND listed ${CMAKE_MATCH_1})
    set(limit_own_${CMAKE_MATCH_1} ${CMAKE_MATCH_2})
    set(limit_all_${CMAKE_MATCH_1} ${CMAKE_MATCH_3})
endforeach()

if(UPDATE)
    if(NOT "all" IN_LIST columns)
        message(FATAL_ERROR "weight.txt is written with libstdc++ 12 and GLM 0.9.9.8")
    endif()
    set(text "# Limits of hygiene/weight, see weight.cmake: header, lines of nook, lines in all\n")
    foreach(header IN LISTS headers)
        set(row ${header})
        math(EXPR fresh_own "(${own_${header}} * 11 / 10 + 20 + 9) / 10 * 10")
        math(EXPR fresh_all "(${all_${header}} * 21 / 20 + 100 + 99) / 100 * 100")
        foreach(which own all)
            set(limit ${fresh_${which}})
            # One that fits, and has not become more than twice as generous as it was meant.
            if(header IN_LIST listed)
                math(EXPR generous "2 * ${limit} - ${${which}_${header}}")
                set(old ${limit_${which}_${header}})
                if(old GREATER_EQUAL ${which}_${header} AND old LESS_EQUAL generous)
                    set(limit ${old})
                endif()
            endif()
            string(APPEND row " ${limit}")
        endforeach()
        string(APPEND text "${row}\n")
    endforeach()
    file(WRITE ${table} "${text}")
    return()
endif()

set(again "the head of tests/hygiene/weight.cmake tells how")
set(what_own "lines of nook")
set(what_all "lines in all")
foreach(header IN LISTS headers)
    if(NOT header IN_LIST listed)
        message(SEND_ERROR "${header} has no line in tests/hygiene/weight.txt (${own_${header}} "
            "lines of nook, ${all_${header}} in all): write the limits anew, ${again}")
        continue()
    endif()
    foreach(column IN LISTS columns)
        if(${column}_${header} GREATER limit_${column}_${header})
            message(SEND_ERROR "${header} has ${${column}_${header}} ${what_${column}}, more than its "
                "limit of ${limit_${column}_${header}}: include less, or raise the limit, ${again}")
        endif()
    endforeach()
endforeach()
foreach(header IN LISTS listed)
    if(NOT header IN_LIST headers)
        message(SEND_ERROR "tests/hygiene/weight.txt lists ${header}, which is no header: delete it")
    endif()
endforeach()

# The include rule, what pages say of each other, a run's directory, the built program from outside, and the launcher.
polypic_test(includes LABEL fast LINK polypic_base)
polypic_test(documents LABEL fast LINK polypic_base)
target_compile_definitions(test_documents PRIVATE POLYPIC_VERSION="${PROJECT_VERSION}")
polypic_test(app_stages LABEL fast LINK polypic_app nlohmann_json::nlohmann_json)
polypic_test(app_cli STARTS_PROGRAM LABEL fast LINK polypic_app)
polypic_test(app_film STARTS_PROGRAM LABEL slow)
polypic_test(run_report STARTS_PROGRAM LABEL slow)
polypic_test(app_resume STARTS_PROGRAM LABEL slow)
polypic_test(app_transfers STARTS_PROGRAM LABEL slow)
polypic_test(app_strange STARTS_PROGRAM LABEL slow)
polypic_test(app_plan STARTS_PROGRAM LABEL slow)
add_library(embree_calls MODULE embree_calls.cpp)
target_link_libraries(embree_calls PRIVATE polypic_options dl)
target_compile_definitions(test_app_plan PRIVATE EMBREE_COUNTER="$<TARGET_FILE:embree_calls>")
add_dependencies(test_app_plan embree_calls)
polypic_test(verify STARTS_PROGRAM LABEL slow TIMEOUT 900)
add_test(NAME kill_and_resume COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/kill_and_resume.sh $<TARGET_FILE:polypic> 8)
set_tests_properties(kill_and_resume PROPERTIES LABELS slow TIMEOUT 300 COST 20)   # what takes long and one core starts first
add_test(NAME full_disk COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/full_disk.sh $<TARGET_FILE:polypic> 12)
set_tests_properties(full_disk PROPERTIES LABELS slow TIMEOUT 300 COST 30 SKIP_RETURN_CODE 77)   # where no disk can be mounted
add_test(NAME launcher COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/launcher.sh ${PROJECT_SOURCE_DIR})
set_tests_properties(launcher PROPERTIES LABELS fast TIMEOUT 60)
# Counts instructions under callgrind: ctest -C full. The driver is for by hand: see the top of the script.
add_executable(step_instructions step_instructions.cpp)
target_link_libraries(step_instructions PRIVATE polypic_sim)
add_test(NAME plan_instructions CONFIGURATIONS full
         COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/step_instructions.py ${CMAKE_CURRENT_BINARY_DIR}/instructions $<TARGET_FILE:polypic>)
set_tests_properties(plan_instructions PROPERTIES LABELS slow TIMEOUT 300 COST 40)
# Opens reports in headless Chromium.
add_test(NAME report_in_browser CONFIGURATIONS full COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/browser.py $<TARGET_FILE:polypic>)
set_tests_properties(report_in_browser PROPERTIES LABELS slow TIMEOUT 300 COST 20)
# The tables of planted faults follow the sources.
foreach(table transfer verify fluid)
  add_test(NAME ${table}_faults_fit CONFIGURATIONS full COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/${table}_faults.py --fits)
  set_tests_properties(${table}_faults_fit PROPERTIES LABELS fast TIMEOUT 60)
endforeach()

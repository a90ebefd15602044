"""Readers of motion files: from text to interpolated samples in ICRF axes.

motion_reader    entry: detects the format by content and returns a law of simgl.motion
oem, aem, ccsds_states
                 CCSDS messages: ephemerides; one state (OPM) or attitude (APM)
ccsds_kvn, ccsds_xml
                 their two notations
stk              STK's ephemeris (.e) and attitude (.a)
spice            meta-kernels, sampled through spice_process, a process of its own
tle, csv_table   two-line elements; tables with named columns
motion_record    states and attitudes independent of format, and their conversion to ICRF
text_lines       lines with numbers, for errors that name file and line

A new format is a module that returns records, and a branch in motion_reader.
"""

// Of a workgroup; the names are defined by whoever loads the program.
layout(local_size_x = GROUP_COLUMNS, local_size_y = GROUP_ROWS) in;

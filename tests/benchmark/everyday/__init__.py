"""Path tracing beside Cycles in scenes as people make them on any day."""

"""Programs that make what simgl ships: models, maps, catalogues, generated pages."""

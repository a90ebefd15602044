"""What lies behind spacecraft: Earth, air, clouds, Moon, Sun and stars."""
